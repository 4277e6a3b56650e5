# SPDX-License-Identifier: Apache-2.0
"""Names of the joints of a TIAGo++, and the joint positions of its start pose [rad or m]."""

from __future__ import annotations

from collections.abc import Mapping

ARMS: Mapping[str, tuple[str, ...]] = {
    side: tuple(f"arm_{side}_{i}_joint" for i in range(1, 8)) for side in ("left", "right")
}
FINGERS: Mapping[str, tuple[str, ...]] = {
    side: tuple(f"gripper_{side}_{finger}_finger_joint" for finger in ("right", "left")) for side in ("left", "right")
}
TORSO = ("torso_lift_joint",)
HEAD = ("head_1_joint", "head_2_joint")
WHEELS = ("wheel_left_joint", "wheel_right_joint")

# End of PAL's `home` motion: both arms tucked before the chest.
HOME_ARM = (-1.1, 1.4679, 2.714, 1.7095, -1.5708, 1.3898, 0.0)
ACTUATED = (*TORSO, *HEAD, *ARMS["left"], *ARMS["right"], *FINGERS["left"], *FINGERS["right"])


def home_positions(torso: float, head: tuple[float, float], finger: float) -> dict[str, float]:
    """Return the pose [rad or m] of every actuated joint with both arms tucked."""
    pose = {name: angle for side in ARMS for name, angle in zip(ARMS[side], HOME_ARM, strict=True)}
    pose |= {name: finger for side in FINGERS for name in FINGERS[side]}
    return pose | {TORSO[0]: torso, HEAD[0]: head[0], HEAD[1]: head[1]}
