# SPDX-License-Identifier: Apache-2.0
"""Pointing with index and middle finger side by side."""

from __future__ import annotations

from uncom_perception.hands.styles.options import POINTING_STYLE
from uncom_perception.hands.styles.style import PointingStyle, Pose


class TwoFingersStyle(PointingStyle):
    """Index and middle finger out and together, ring and little finger curled."""

    name = "two_fingers"
    line = (5, 6, 7, 8)

    def evidence(self, pose: Pose) -> float:
        """Return the extension of both, the curl of the others; none for spread fingers."""
        if pose.spread_rad > POINTING_STYLE.side_by_side_rad:
            return 0.0
        return 0.9 * pose.index * pose.middle * (1.0 - max(pose.ring, pose.little))
