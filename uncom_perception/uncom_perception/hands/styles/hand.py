# SPDX-License-Identifier: Apache-2.0
"""Pointing with the whole hand: all fingers out and together, from the wrist to the tip of the middle finger."""

from __future__ import annotations

from uncom_perception.hands.styles.style import PointingStyle, Pose

_TOGETHER_RAD = 0.2  # fingers of a hand that says "stop" or shows its palm are spread wider
_WEIGHT = 0.7  # a flat hand is as often a greeting


class HandStyle(PointingStyle):
    """A flat hand; off unless asked for, since an open palm is no pointing to most people."""

    name = "hand"
    line = (0, 9, 10, 11, 12)

    def evidence(self, pose: Pose) -> float:
        """Return the extension of all four fingers; none for spread ones."""
        if pose.spread_rad > _TOGETHER_RAD:
            return 0.0
        return _WEIGHT * min(pose.index, pose.middle, pose.ring, pose.little)
