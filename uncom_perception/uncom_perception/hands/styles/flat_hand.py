# SPDX-License-Identifier: Apache-2.0
"""Pointing with the whole hand: all fingers out and together, from the wrist to the tip of the middle finger."""

from __future__ import annotations

from uncom_perception.hands.styles.options import POINTING_STYLE
from uncom_perception.hands.styles.style import PointingStyle, Pose


class HandStyle(PointingStyle):
    """A flat hand; off unless asked for, since an open palm is no pointing to most people."""

    name = "hand"
    line = (0, 9, 10, 11, 12)

    def evidence(self, pose: Pose) -> float:
        """Return the extension of all four fingers; none for spread ones."""
        if pose.spread_rad > POINTING_STYLE.together_rad:
            return 0.0
        return POINTING_STYLE.flat_hand_weight * min(pose.index, pose.middle, pose.ring, pose.little)
