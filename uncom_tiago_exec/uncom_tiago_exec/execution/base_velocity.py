# SPDX-License-Identifier: Apache-2.0
"""The velocity profile of a short straight drive of the base."""

from __future__ import annotations

import numpy as np

DRIVE_SPEED = 0.12  # [m/s]
DRIVE_GAIN = 2.5  # [1/s] the last centimetres are driven ever slower
DRIVE_TOLERANCE = 0.002  # [m]


def drive_velocity(remaining: float) -> float:
    """Return the velocity [m/s] at which to drive the distance that remains [m]; 0 once it is small enough."""
    if abs(remaining) < DRIVE_TOLERANCE:
        return 0.0
    pace = min(DRIVE_SPEED, max(DRIVE_GAIN * abs(remaining), 0.008))
    return float(np.copysign(pace, remaining))
