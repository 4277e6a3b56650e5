# SPDX-License-Identifier: Apache-2.0
"""The measures of a parallel gripper, in its grasping frame."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GripperShape:
    """The gripper in its grasping frame (x approach, y opening, z across the pads) [m].

    tip: x of the finger tips; palm: x of the palm's front; thickness: of a finger along y;
    half_width: of a pad along z; open: greatest gap between the pads; body: half extents of the palm in y and z.
    """

    tip: float
    palm: float
    thickness: float
    half_width: float
    open: float
    body: tuple[float, float]
