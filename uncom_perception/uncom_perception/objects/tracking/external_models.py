# SPDX-License-Identifier: Apache-2.0
"""Poses of objects from an outside estimator (paper: iChores, GDRNet++), matched to the objects that are seen.

A mesh tells what is not seen of an object: who grasps it gets the whole of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from uncom_common.transforms import apply, invert

from uncom_perception.objects.tracking.options import MODEL_FIT, ModelFitOptions
from uncom_perception.types import Detection, FloatArray, Geometry, ObjectModel, Scene


def with_models(
    scene: Scene,
    models: Sequence[ObjectModel],
    same_name: Callable[[str, str], bool],
    eye: FloatArray | None = None,
    *,
    options: ModelFitOptions = MODEL_FIT,
) -> Scene:
    """Give each object the outside model that overlaps it best, if any does; names that agree count, too.

    An object whose model has a mesh is as large as that from then on, and its cloud is of all of its surface.

    Args:
        options: numbers that tune it.
        scene: with geometry.
        models: in the scene's frame.
        same_name: whether two words mean the same kind of object.
        eye: where the camera was (3,), in the scene's frame; None if that is not known.
    """
    objects = [d for d in scene.detections if d.geometry is not None]
    if not objects or not models:
        return scene
    agreement = np.array([[_agreement(d, m, same_name, options=options) for m in models] for d in objects])
    chosen: dict[str, ObjectModel] = {}
    for i, j in zip(*linear_sum_assignment(-agreement), strict=True):
        if agreement[i, j] >= options.least_agreement:
            chosen[objects[i].id] = models[int(j)]
    return replace(
        scene, detections=tuple(_with_model(d, chosen.get(d.id), eye, options=options) for d in scene.detections)
    )


def _with_model(
    detection: Detection, model: ObjectModel | None, eye: FloatArray | None, *, options: ModelFitOptions = MODEL_FIT
) -> Detection:
    body = detection.geometry
    return replace(
        detection,
        model=model,
        geometry=completed(body, model, eye, options=options) if body is not None and model else body,
    )


def completed(
    body: Geometry, model: ObjectModel, eye: FloatArray | None = None, *, options: ModelFitOptions = MODEL_FIT
) -> Geometry:
    """Return a seen object as its model's mesh completes it; as it is if there is no mesh, or one that does not fit.

    The estimator's error is taken out as far as what is seen tells it: the mesh is moved to the seen points. The side
    that it stands on is left out of the cloud: no hand gets there, and inside an edge it would pass for the floor.

    Args:
        options: numbers that tune it.
        body: the object as it is seen.
        model: in the frame of the body.
        eye: where the camera was (3,) in that frame: only sides that face it are seen. Thin walls have two.
    """
    surface, normals = _surface(model, options=options)
    if len(surface) == 0 or len(body.cloud) < options.fewest_points:
        return body
    to_body = invert(body.pose)
    local, turned = apply(to_body, surface), normals @ to_body[:3, :3].T
    seen = apply(to_body, body.cloud[:: max(1, len(body.cloud) // options.enough_points)].astype(float))
    correction = (
        None if eye is None else _correction(local, turned, seen, apply(to_body, eye[None])[0], options=options)
    )
    if correction is None:  # a mesh that is not closed has no outside
        correction = _correction(local, turned, seen, None, options=options)
    if correction is None:
        return body
    local, upwards = apply(correction, local), turned @ correction[2, :3]
    (x, y), (a, b), angle = cv2.minAreaRect(local[:, :2].astype(np.float32))
    if b > a:
        a, b, angle = b, a, angle + 90.0
    yaw = np.radians((angle + 90.0) % 180.0 - 90.0)
    low, high = float(local[:, 2].min()), float(local[:, 2].max())
    inner = np.eye(4)
    inner[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    inner[:3, 3] = (x, y, 0.5 * (low + high))
    pose = body.pose @ inner
    under = (upwards < options.faces_down) & (local[:, 2] < low + options.foot_m)
    cloud = apply(body.pose, local[~under]).astype(np.float32)
    return Geometry(pose[:3, 3].copy(), pose, np.array([a, b, high - low]), cloud)


def _correction(
    surface: FloatArray,
    normals: FloatArray,
    seen: FloatArray,
    eye: FloatArray | None,
    *,
    options: ModelFitOptions = MODEL_FIT,
) -> FloatArray | None:
    """Return the small motion (4, 4) of a surface (N, 3) to what is seen of it (M, 3), or None if it does not fit.

    Each seen point draws along the surface's normal (N, 3) only, so that sides of which little is seen count, too.
    """
    if eye is not None:
        facing = np.einsum("ij,ij->i", normals, eye - surface) > 0.0
        surface, normals = surface[facing], normals[facing]
    if len(surface) < options.fewest_points:
        return None
    motion = np.eye(4)
    for _ in range(options.rounds):
        points, towards = apply(motion, surface), normals @ motion[:3, :3].T
        found = cKDTree(points).query(seen)
        away, nearest = np.asarray(found[0]), np.asarray(found[1])
        usable = away < options.farthest_m
        p, n = points[nearest[usable]], towards[nearest[usable]]
        along = np.einsum("ij,ij->i", n, seen[usable] - p)
        by = np.concatenate([n, np.cross(p, n) / options.lever_m], axis=1)  # turned about the object's middle
        step = np.linalg.solve(by.T @ by + options.stiffness * len(seen) * np.eye(6), by.T @ along)
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(step[3:] / options.lever_m).as_matrix()
        turn[:3, 3] = step[:3]
        motion = turn @ motion
    left = float(np.median(cKDTree(apply(motion, surface)).query(seen)[0]))
    return motion if left <= options.fits_m and float(np.linalg.norm(motion[:3, 3])) <= options.farthest_m else None


def _surface(model: ObjectModel, *, options: ModelFitOptions = MODEL_FIT) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 3) spread over a model's mesh and their outward unit normals, as its pose places it."""
    if len(model.triangles) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    corners = model.vertices[model.triangles]
    across, down = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(across, down)
    areas = np.linalg.norm(normals, axis=1)
    if float(areas.sum()) <= 0.0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    middle = corners.mean(axis=(0, 1))
    if float(np.einsum("ij,ij->", corners[:, 0] - middle, normals)) < 0.0:  # of its volume: the corners go clockwise
        normals = -normals
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(areas), options.mesh_points, p=areas / areas.sum())
    share = rng.random((options.mesh_points, 2))
    beyond = share.sum(axis=1) > 1.0
    share[beyond] = 1.0 - share[beyond]
    local = corners[chosen, 0] + share[:, :1] * across[chosen] + share[:, 1:] * down[chosen]
    unit = normals[chosen] / areas[chosen, None]
    return np.asarray(apply(model.pose, local)), np.asarray(unit @ model.pose[:3, :3].T)


def _agreement(
    detection: Detection,
    model: ObjectModel,
    same_name: Callable[[str, str], bool],
    *,
    options: ModelFitOptions = MODEL_FIT,
) -> float:
    """Return how well a model fits an object, 0 to 1: the overlap of their boxes and their names."""
    body = detection.geometry
    if body is None:
        return 0.0
    overlap = _overlap(body, model, options=options)
    if overlap <= 0.0:
        return 0.0
    return float((0.7 * overlap + 0.3 * same_name(detection.label, model.label)) * (0.5 + 0.5 * model.score))


def _overlap(body: Geometry, model: ObjectModel, *, options: ModelFitOptions = MODEL_FIT) -> float:
    """Return the share of the model that lies in the object's box, or how near its origin is to it without a mesh."""
    half = body.size / 2.0 + options.margin_m
    points: FloatArray = model.pose[:3, 3][None]
    if len(model.vertices) >= options.least_vertices:
        points = apply(model.pose, model.vertices[:: max(1, len(model.vertices) // 300)])
    local = np.abs(apply(invert(body.pose), points))
    if len(points) == 1:
        return float(np.clip(1.5 - (local[0] / half).max(), 0.0, 1.0))
    return float((local <= half).all(axis=1).mean())
