# SPDX-License-Identifier: Apache-2.0
"""The true scene as a perfect detector would return it, for the ablation "true detections"."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import apply, invert
from uncom_perception.types import Attribute, Box, Detection, Geometry, Mask, Scene, TableSurface

from uncom_sim.bench_understanding.judging.options import GROUND_TRUTH, GroundTruthOptions
from uncom_sim.bench_understanding.judging.verdict import scene_object_of
from uncom_sim.objects.catalogue import model
from uncom_sim.types import ObjectState, Table
from uncom_sim.types import Scene as SimScene
from uncom_sim.world.intended_meaning import named_objects

FloatArray = npt.NDArray[np.float64]

_FRUIT = frozenset(("banana", "apple", "lemon", "orange", "pear"))
_GENERIC_NOUNS = frozenset(
    ("object", "objects", "thing", "things", "item", "items", "one", "ones", "this", "that", "it")
)
_CONTAINERS = frozenset(("container", "containers", "vessel", "vessels"))
_SYNONYMS = {"pan": "frying pan", "cereal": "cereal box", "fruits": "fruit"}


def true_scene(
    states: Sequence[ObjectState],
    table: Table,
    phrases: Sequence[str],
    camera: PinholeCamera,
    camera_in_base: FloatArray,
    stamp_s: float,
    *,
    options: GroundTruthOptions = GROUND_TRUTH,
) -> Scene:
    """Return the scene as it is, in base_footprint; camera_in_base (4, 4) is the optical frame's pose there."""
    fits = [_matching_ids(phrase, states, table) for phrase in phrases]
    detections = []
    for number, state in enumerate(states):
        shape = model(state.kind, state.colour)
        points = np.concatenate([apply(state.pose, part.vertices) for part in shape.parts])
        mask = _mask(state, camera, camera_in_base)
        detections.append(
            Detection(
                id=f"thing_{number + 1}",
                label=state.kind,
                score=1.0,
                box=_box(mask),
                mask=mask,
                geometry=_geometry(state, points, options=options),
                attributes=_attributes(state),
                phrase_scores=tuple(options.sure / max(len(f), 1) if state.id in f else options.unsure for f in fits),
            )
        )
    none = tuple(1.0 - options.sure if f else options.sure for f in fits)
    return Scene(stamp_s, "base_footprint", tuple(detections), _surface(table, camera, camera_in_base), none, "truth")


def _matching_ids(phrase: str, states: Sequence[ObjectState], table: Table) -> frozenset[str]:
    """Return the ids of the objects that a noun phrase fits."""
    tokens = [_SYNONYMS.get(token, token) for token in phrase.lower().split()]
    if not tokens:
        return frozenset()
    scene = SimScene(objects=tuple(scene_object_of(s) for s in states), say="", table=table)
    found: set[str] = set(named_objects(scene, " ".join(tokens).split()))
    if not found:
        last, colours = tokens[-1], [t for t in tokens[:-1] if any(s.colour == t for s in states)]
        for state in states:
            container = model(state.kind, state.colour).opening is not None
            named = last in _GENERIC_NOUNS or (last in _CONTAINERS and container)
            if (named or (last == "fruit" and state.kind in _FRUIT)) and all(c == state.colour for c in colours):
                found.add(state.id)
    return frozenset(found)


def _mask(state: ObjectState, camera: PinholeCamera, camera_in_base: FloatArray) -> Mask:
    """Return the silhouette, as if nothing stood before the object."""
    picture = np.zeros((camera.height, camera.width), np.uint8)
    to_camera = invert(camera_in_base) @ state.pose
    for part in model(state.kind, state.colour).parts:
        pixels = camera.project(apply(to_camera, part.vertices))
        for triangle in np.round(pixels[part.faces]).astype(np.int32):
            cv2.fillConvexPoly(picture, triangle, 1)
    return picture.astype(bool)


def _box(mask: Mask) -> Box:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        return Box(0.0, 0.0, 0.0, 0.0)
    return Box(float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))


def _geometry(state: ObjectState, points: FloatArray, *, options: GroundTruthOptions = GROUND_TRUTH) -> Geometry:
    step = max(1, len(points) // options.cloud_points)
    bounds = model(state.kind, state.colour).bounds
    pose = state.pose.copy()
    pose[:3, 3] = apply(state.pose, bounds.mean(axis=0))
    return Geometry(pose[:3, 3].copy(), pose, np.asarray(bounds[1] - bounds[0]), points[::step].astype(np.float32))


def _attributes(state: ObjectState) -> tuple[Attribute, ...]:
    hollow = model(state.kind, state.colour).opening is not None
    return (Attribute("colour", state.colour, 0.95), Attribute("hollow", "yes", 1.0 if hollow else 0.0))


def _surface(table: Table, camera: PinholeCamera, camera_in_base: FloatArray) -> TableSurface:
    corners = np.array(
        [
            (table.x_min, table.y_min, table.height),
            (table.x_max, table.y_min, table.height),
            (table.x_max, table.y_max, table.height),
            (table.x_min, table.y_max, table.height),
        ]
    )
    pixels = camera.project(apply(invert(camera_in_base), corners))
    return TableSurface(corners, np.array([0.0, 0.0, 1.0]), pixels)
