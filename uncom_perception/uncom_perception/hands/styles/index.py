# SPDX-License-Identifier: Apache-2.0
"""Pointing with the index finger (paper, section III-E)."""

from __future__ import annotations

from uncom_perception.hands.styles.options import POINTING_STYLE
from uncom_perception.hands.styles.style import PointingStyle, Pose


class IndexStyle(PointingStyle):
    """Index finger out, the other three curled; the thumb is free."""

    name = "index"
    line = (5, 6, 7, 8)

    def evidence(self, pose: Pose) -> float:
        """Return index extension and the curl of the others together."""
        spread_middle = (
            pose.middle if pose.spread_rad > POINTING_STYLE.side_by_side_rad else 0.0
        )  # a "V" is the number two
        return pose.index * min(pose.curl_of_others, 1.0 - spread_middle)
