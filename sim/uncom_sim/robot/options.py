# SPDX-License-Identifier: Apache-2.0
"""Numbers of the simulated robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.transforms import FloatArray
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class GripperModel:
    """Shape, masses and limits of the parallel gripper, as PAL's has them."""

    stroke_m: float = tunable(0.045, unit="m", meaning="stroke of one finger")
    effort_n: float = tunable(16.0, unit="N", meaning="greatest force of one finger")
    speed_m_s: float = tunable(0.05, unit="m/s", meaning="greatest speed of one finger")
    grasping_frame_z_m: float = tunable(
        -0.12, unit="m", meaning="place of the grasping frame on the z axis of gripper_<side>_link"
    )
    pad_size_m: tuple[float, float, float] = tunable(
        (0.01, 0.05, 0.11), unit="m", meaning="thickness, width and length of a finger's pad"
    )
    pad_centre_z_m: float = tunable(-0.165, unit="m", meaning="middle of the pads on the z axis of gripper_<side>_link")
    soft_limit_margin_m: float = tunable(0.001, unit="m", meaning="margin of the soft limits inside the hard ones")
    palm_mass_kg: float = tunable(0.603, unit="kg", meaning="mass of the palm")
    finger_mass_kg: float = tunable(0.110, unit="kg", meaning="mass of one finger")


@dataclass(frozen=True, slots=True)
class FingerFrictionOptions:
    """Dry friction in the spindles of the fingers, by a bristle model."""

    friction_n: float = tunable(12.0, unit="N", meaning="friction of one finger's spindle")
    bristle_m: float = tunable(0.001, unit="m", meaning="how far the fingers give before they slip", source="Dahl 1968")
    correction: float = tunable(0.5, meaning="share of that made good in one step")


@dataclass(frozen=True, slots=True)
class JointDriveOptions:
    """How motors and the base follow their set-points, and what the pads grip with."""

    base_efforts: tuple[float, float, float] = tunable(
        (600.0, 600.0, 300.0), unit="N, N, N m", meaning="what the drive can push and turn with along x, y and about z"
    )
    position_gain: float = tunable(0.1, meaning="share of a position error made good in one step")
    pad_friction: float = tunable(1.2, meaning="coefficient of friction of the finger pads (rubber)")
    base_lead_limits: tuple[float, float, float] = tunable(
        (0.02, 0.02, 0.02), unit="m, m, rad", meaning="how far the base's set-point may run ahead of it"
    )

    @property
    def base_lead(self) -> FloatArray:
        """Return base_lead_limits as an array (3,)."""
        return np.array(self.base_lead_limits)


@dataclass(frozen=True, slots=True)
class VisualMeshOptions:
    """How far the robot's visible shapes are simplified."""

    cells_m: tuple[tuple[str, float], ...] = tunable(
        (("pmb2", 0.016), ("torso", 0.012), ("head", 0.007)), unit="m", meaning="grid by part of the robot"
    )
    cell_m: float = tunable(0.008, unit="m", meaning="grid elsewhere: the arms, which come near the camera")


GRIPPER = GripperModel()
FINGER_FRICTION = FingerFrictionOptions()
JOINT_DRIVES = JointDriveOptions()
VISUAL_MESHES = VisualMeshOptions()
