# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune tracking."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ModelFitOptions:
    """How a mesh of an outside estimator is fitted to what is seen."""

    margin_m: float = tunable(0.02, unit="m", meaning="margin around an object within which a model's centre may lie")
    least_agreement: float = tunable(0.35, meaning="agreement below which a model is of something else")
    mesh_points: int = tunable(4000, meaning="points on a mesh")
    fewest_points: int = tunable(30, meaning="points of what is seen below which nothing is fitted")
    enough_points: int = tunable(600, meaning="points of what is seen that suffice")
    rounds: int = tunable(8, meaning="rounds of the fit")
    lever_m: float = tunable(
        0.05, unit="m", meaning="distance from the middle at which a turn counts as much as a shift"
    )
    stiffness: float = tunable(0.003, meaning="how little a side of which next to nothing is seen moves the mesh")
    faces_down: float = tunable(-0.7, meaning="z of the normal below which a side faces down")
    foot_m: float = tunable(
        0.015, unit="m", meaning="height up to which such a side is the one that an object stands on"
    )
    fits_m: float = tunable(0.006, unit="m", meaning="mean distance of what is seen from the mesh up to which it fits")
    farthest_m: float = tunable(0.04, unit="m", meaning="how far a mesh may be shifted")
    least_vertices: int = tunable(4, meaning="vertices of a mesh that encloses anything")


@dataclass(frozen=True, slots=True)
class TrackerOptions:
    """When an object is the one that was seen before."""

    near_m: float = tunable(0.06, unit="m", meaning="objects this near to where one was may be that one")
    moved_m: float = tunable(0.04, unit="m", meaning="a greater shift is told as a move")
    behind_m: float = tunable(
        0.02, unit="m", meaning="how much farther than an object the camera must see for it to be gone"
    )
    gone_share: float = tunable(0.6, meaning="share of the places that it was seen at")
    alike: float = tunable(0.45, meaning="least likeness of an object that moved")
    sample: int = tunable(150, meaning="points of an object that are looked at")
    greatest_cost: float = tunable(5.0, meaning="cost of a match above which an object is a new one")


MODEL_FIT = ModelFitOptions()
TRACKER = TrackerOptions()
