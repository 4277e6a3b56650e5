# SPDX-License-Identifier: Apache-2.0
"""The dimensions of a parallel gripper, in its grasping frame."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GripperShape:
    """Dimensions of the gripper in its grasping frame (x approach, y opening, z across the pads) [m].

    Seen along -z, fingers open; z (across the pads) points to the reader, the origin lies on the x axis:

        y (opening)
        ^        +------+
        |        |      +--------------------+  ---
        +--> x   |      |       finger       |   |  thickness
      (approach) |      +--------------------+  ---
            ---  |      |                       |
             |   | palm |                       |  open
       body[0]   |      |                       |
            ---  | - - -|- - - - - - - - - - - -|- - - axis y = 0
                 |      |                       |
                 |      +--------------------+  ---
                 |      |       finger       |
                 |      +--------------------+
                 +------+                    :
                        :                    :
                    x = palm              x = tip

    Seen along +x, from behind the palm, a pad reaches from -half_width to +half_width along z, the palm from -body[1]
    to +body[1].

    Attributes:
        tip: x of the finger tips.
        palm: x of the front of the palm.
        thickness: of a finger along y.
        half_width: half the width of a pad along z.
        open: greatest gap between the pads.
        body: half extents of the palm in y and z.
    """

    tip: float
    palm: float
    thickness: float
    half_width: float
    open: float
    body: tuple[float, float]
