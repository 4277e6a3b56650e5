# SPDX-License-Identifier: Apache-2.0
"""Criteria by which physics decides whether a command was carried out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class RelationCriteria:
    """When something is near, beside or at a place."""

    area_radius_m: float = tunable(0.12, unit="m", meaning="how far from the place meant is still there")
    near_m: float = tunable(0.15, unit="m", meaning="greatest gap of what is next to something")
    beside_m: float = tunable(0.30, unit="m", meaning="greatest gap of what is left, right, in front or behind")
    cone_deg: float = tunable(
        50.0, unit="deg", meaning="how far off its direction left, right, in front and behind reach"
    )

    @property
    def cone_cos(self) -> float:
        """Return the cosine of cone_deg."""
        return float(np.cos(np.radians(self.cone_deg)))


@dataclass(frozen=True, slots=True)
class EndStateCriteria:
    """What must hold of the objects at the end."""

    moved_m: float = tunable(0.05, unit="m", meaning="how far other objects may be moved")
    lifted_m: float = tunable(0.05, unit="m", meaning="rise from which on an object is lifted")
    upright_deg: float = tunable(30.0, unit="deg", meaning="greatest tilt of what stands upright")
    fallen_m: float = tunable(0.05, unit="m", meaning="depth below the table at which an object has fallen off")
    over_rim_m: float = tunable(
        0.03,
        unit="m",
        meaning="gap above a rim, or above or below a top, of what is on it",
    )
    lying_m: float = tunable(
        0.02, unit="m", meaning="greatest distance of an object's underside from the table that it lies on"
    )

    @property
    def upright_cos(self) -> float:
        """Return the cosine of upright_deg."""
        return float(np.cos(np.radians(self.upright_deg)))


@dataclass(frozen=True, slots=True)
class ActCriteria:
    """What must have happened on the way: pouring, giving, pointing."""

    observed_steps: int = tunable(24, meaning="physics steps from one observation to the next")
    pouring_tilt_deg: float = tunable(95.0, unit="deg", meaning="tilt beyond which a container runs empty")
    poured_s: float = tunable(0.5, unit="s", meaning="how long it must be tilted so")
    spilling_tilt_deg: float = tunable(60.0, unit="deg", meaning="tilt at which a full container loses something")
    stayed_m: float = tunable(0.05, unit="m", meaning="how far an object may be moved that is to stay")
    given_ahead_m: float = tunable(0.45, unit="m", meaning="least distance ahead of the robot of what is held out")
    given_above_m: float = tunable(0.15, unit="m", meaning="least height above the table of what is held out")
    pointed_m: float = tunable(0.03, unit="m", meaning="greatest distance of the fingers' line from what is pointed at")
    pointed_from_m: float = tunable(0.25, unit="m", meaning="how far ahead of the fingers the line reaches")
    level_deg: float = tunable(35.0, unit="deg", meaning="greatest tilt of what is held out and could run empty")
    tip_m: float = tunable(0.05, unit="m", meaning="how far ahead of the grasping frame the line begins")

    @property
    def pouring_tilt_rad(self) -> float:
        """Return pouring_tilt_deg in radians."""
        return float(np.radians(self.pouring_tilt_deg))

    @property
    def spilling_tilt_rad(self) -> float:
        """Return spilling_tilt_deg in radians."""
        return float(np.radians(self.spilling_tilt_deg))

    @property
    def level_cos(self) -> float:
        """Return the cosine of level_deg."""
        return float(np.cos(np.radians(self.level_deg)))


RELATION_CRITERIA = RelationCriteria()
END_STATE = EndStateCriteria()
ACTS = ActCriteria()
