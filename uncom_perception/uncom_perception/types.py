# SPDX-License-Identifier: Apache-2.0
"""Values of seeing. Pixels are (u, v); metric values are in the frame named beside them [m]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

LEAST_CORNERS = 3  # of an outline that encloses anything


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box in the image [px]."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float

    @property
    def center(self) -> tuple[float, float]:
        """Centre (u, v)."""
        return (self.x_min + self.x_max) / 2.0, (self.y_min + self.y_max) / 2.0


@dataclass(frozen=True, slots=True)
class MetricRay:
    """Pointing ray in space: origin (index base), tip and unit direction, each (3,), camera optical frame [m]."""

    origin: FloatArray
    tip: FloatArray
    direction: FloatArray


@dataclass(frozen=True, slots=True)
class PointingRay:
    """Where a hand points (paper, section III-E): index base to tip, unit direction in the image [px]."""

    origin: tuple[float, float]
    tip: tuple[float, float]
    direction: tuple[float, float]
    sigma_rad: float
    metric: MetricRay | None = None
    style: str = "index"


@dataclass(frozen=True, slots=True)
class Hand:
    """One hand: landmarks (21, 3) are x, y [px] and z relative to the wrist [px]."""

    handedness: str
    score: float
    landmarks: FloatArray
    ray: PointingRay | None = None
    depth_m: float = 0.0

    @property
    def pointing(self) -> bool:
        """Whether the hand points."""
        return self.ray is not None


@dataclass(frozen=True, slots=True)
class HandsFrame:
    """The hands of one image; pointing_hand is the index of the one that points, or None."""

    stamp_s: float
    frame_id: str
    width: int
    height: int
    hands: tuple[Hand, ...]
    pointing_hand: int | None = None
    backend: str = ""
    latency_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Attribute:
    """A named property measured on pixels and points."""

    name: str
    value: str
    probability: float


@dataclass(frozen=True, slots=True)
class Geometry:
    """An object in space [m].

    Centroid (3,), oriented box (yaw only) as pose (4, 4) of its centre and size (3,), cloud (N, 3).
    """

    centroid: FloatArray
    pose: FloatArray
    size: FloatArray
    cloud: npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ObjectModel:
    """An object's 6-DoF pose (4, 4) by an outside estimator, and its mesh.

    Vertices (N, 3) in the object's own frame [m], triangles (M, 3) of their indices; empty where there is no mesh.
    """

    label: str
    score: float
    pose: FloatArray
    vertices: FloatArray
    triangles: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Detection:
    """One object seen in one image; phrase_scores follow the order of the phrases asked for.

    track is its name over images, empty where nothing follows objects; model is what an outside estimator knows of it.
    """

    id: str
    label: str
    score: float
    box: Box
    mask: Mask
    geometry: Geometry | None = None
    attributes: tuple[Attribute, ...] = ()
    phrase_scores: tuple[float, ...] = ()
    track: str = ""
    model: ObjectModel | None = None


@dataclass(frozen=True, slots=True)
class TableSurface:
    """The table top.

    Outline (N, 3) counter-clockwise from above [m], unit normal (3,), outline in the image (M, 2) [px].
    """

    polygon: FloatArray
    normal: FloatArray
    image_polygon: FloatArray

    @property
    def height_m(self) -> float:
        """Mean z of the outline in its frame."""
        return float(self.polygon[:, 2].mean())


@dataclass(frozen=True, slots=True)
class Scene:
    """What a detector answers: objects, the table (or None), and per phrase the probability that nothing here is meant.

    frame_id is the base frame where the camera's pose was given, else the camera's optical frame. Tracks that are gone
    from where they were, or elsewhere, are named.
    """

    stamp_s: float
    frame_id: str
    detections: tuple[Detection, ...]
    table: TableSurface | None
    phrase_none: tuple[float, ...]
    backend: str
    latency_s: float = 0.0
    vanished_tracks: tuple[str, ...] = ()
    moved_tracks: tuple[str, ...] = ()
