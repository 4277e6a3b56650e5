# SPDX-License-Identifier: Apache-2.0
"""Poses of things from an outside estimator (paper: iChores, GDRNet++), matched to the things that are seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from uncom_common.transforms import apply, invert

from uncom_perception.types import Detection, FloatArray, Geometry, ObjectModel, Scene

_MARGIN_M = 0.02
_LEAST = 0.35  # agreement below which a model is of something else


def with_models(scene: Scene, models: Sequence[ObjectModel], same_name: Callable[[str, str], bool]) -> Scene:
    """Give each thing the outside model that overlaps it best, if any does; names that agree count, too.

    Args:
        scene: with geometry.
        models: in the scene's frame.
        same_name: whether two words mean the same kind of thing.
    """
    things = [d for d in scene.detections if d.geometry is not None]
    if not things or not models:
        return scene
    agreement = np.array([[_agreement(d, m, same_name) for m in models] for d in things])
    chosen: dict[str, ObjectModel] = {}
    for i, j in zip(*linear_sum_assignment(-agreement), strict=True):
        if agreement[i, j] >= _LEAST:
            chosen[things[i].id] = models[int(j)]
    found = tuple(replace(d, model=chosen.get(d.id)) for d in scene.detections)
    return replace(scene, detections=found)


def _agreement(detection: Detection, model: ObjectModel, same_name: Callable[[str, str], bool]) -> float:
    """Return how well a model fits a thing, 0 to 1: the overlap of their boxes and their names."""
    body = detection.geometry
    if body is None:
        return 0.0
    overlap = _overlap(body, model)
    if overlap <= 0.0:
        return 0.0
    return float((0.7 * overlap + 0.3 * same_name(detection.label, model.label)) * (0.5 + 0.5 * model.score))


def _overlap(body: Geometry, model: ObjectModel) -> float:
    """Return the share of the model that lies in the thing's box, or how near its origin is to it without a mesh."""
    half = body.size / 2.0 + _MARGIN_M
    points: FloatArray = model.pose[:3, 3][None]
    if len(model.vertices) >= 4:
        points = apply(model.pose, model.vertices[:: max(1, len(model.vertices) // 300)])
    local = np.abs(apply(invert(body.pose), points))
    if len(points) == 1:
        return float(np.clip(1.5 - (local[0] / half).max(), 0.0, 1.0))
    return float((local <= half).all(axis=1).mean())
