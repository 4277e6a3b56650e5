# SPDX-License-Identifier: Apache-2.0
"""How well an object or a place fits a fused ray: forward only, finite, to the object itself and not to its centre.

In space the error of a point is split into the part across the camera's line of sight (well seen) and the part along
it (from depth, less sure); without depth only the first is known. An error is counted in standard deviations (z), where
the fingertip's own uncertainty widens the cone near the hand. A ray that hits has z = 0, an object behind the hand
a large one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from uncom_common.transforms import FloatArray
from uncom_perception.types import Box, Detection

from uncom_reasoner.gesture_types import Dwell, PhraseRay, RayInSpace, TablePoint
from uncom_reasoner.pointing.options import (
    POINTING_LIKELIHOOD,
    TABLE_POINT,
    PointingLikelihoodOptions,
    TablePointOptions,
)
from uncom_reasoner.support.support_plane import Surface
from uncom_reasoner.types import View
from uncom_reasoner.weights import Weights


@dataclass(frozen=True, slots=True)
class PointingError:
    """How far an object is from a ray: z [standard deviations] of its nearest part, and of its middle."""

    z: float
    z_centre: float


def pointing_error(
    dwell: Dwell, detection: Detection, weights: Weights, options: PointingLikelihoodOptions = POINTING_LIKELIHOOD
) -> PointingError:
    """Measure the error of an object in space where ray and object have depth, else in the image."""
    geometry = detection.geometry
    if dwell.space is not None and geometry is not None and len(geometry.cloud):
        cloud = geometry.cloud[:: max(1, len(geometry.cloud) // options.max_points)].astype(float)
        points = np.vstack([cloud, geometry.centroid[None, :]])
        z = _errors_in_space(dwell, dwell.space, points, weights, options)
    else:
        rows, columns = np.nonzero(detection.mask)
        if len(rows):
            step = max(1, len(rows) // options.max_points)
            pixels = np.column_stack([columns, rows])[::step].astype(float)
        else:
            pixels = _box_points(detection.box, options.box_steps)
        z = _errors_in_image(dwell, np.vstack([pixels, np.array(detection.box.center)[None, :]]), weights, options)
    return PointingError(float(z.min()), float(z[-1]))


def _box_points(box: Box, steps: int) -> FloatArray:
    """Return a grid of pixels (N, 2) over a box."""
    u, v = np.meshgrid(np.linspace(box.x_min, box.x_max, steps), np.linspace(box.y_min, box.y_max, steps))
    return np.column_stack([u.ravel(), v.ravel()])


def _errors_in_image(
    dwell: Dwell, pixels: FloatArray, weights: Weights, options: PointingLikelihoodOptions
) -> FloatArray:
    """Return the error (N,) of pixels (N, 2) from a ray in the image [standard deviations]."""
    d = dwell.direction_px
    v = pixels - dwell.tip_px
    r = np.maximum(np.linalg.norm(v, axis=1), 1e-6)
    angle = np.abs(np.arctan2(d[0] * v[:, 1] - d[1] * v[:, 0], v @ d))
    near = weights.tip_sigma_m * dwell.width / r  # a table about a metre away fills about the image
    z = angle / np.hypot(dwell.sigma_rad, near)
    behind = np.minimum(options.behind_z, r / (options.behind_width_ratio * dwell.width))
    return np.asarray(np.where(angle > np.pi / 2.0, np.maximum(z, behind), z))


def _ray_axes(space: RayInSpace) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ray, the axis across the line of sight and the third one (unit vectors, scene frame)."""
    u = space.direction
    across = np.cross(space.tip - space.eye, u)
    norm = float(np.linalg.norm(across))
    if math.isclose(norm, 0.0, abs_tol=1e-6):  # the finger points along the line of sight: every side is alike
        across = np.cross(u, np.eye(3)[int(np.argmin(np.abs(u)))])
        norm = float(np.linalg.norm(across))
    across = across / norm
    return u, across, np.cross(across, u)


def _errors_in_space(
    dwell: Dwell, space: RayInSpace, points: FloatArray, weights: Weights, options: PointingLikelihoodOptions
) -> FloatArray:
    """Return the error (N,) of points (N, 3) of the scene's frame from a ray in space [standard deviations]."""
    u, across, along = _ray_axes(space)
    v = points - space.tip
    r = np.maximum(np.linalg.norm(v, axis=1), 1e-6)
    lateral = np.arcsin(np.clip((v @ across) / r, -1.0, 1.0))
    in_depth = np.arctan2(v @ along, v @ u)
    near = weights.tip_sigma_m / r
    z = np.hypot(
        lateral / np.hypot(dwell.sigma_rad, near),
        in_depth / np.hypot(dwell.sigma_rad * weights.depth_sigma_ratio, near),
    )
    behind = (v @ u) < 0.0
    return np.asarray(np.where(behind, np.maximum(z, np.minimum(options.behind_z, r / weights.tip_sigma_m)), z))


def ray_log_likelihood(
    ray: PhraseRay,
    errors: dict[int, PointingError],
    stray: float,
    options: PointingLikelihoodOptions = POINTING_LIKELIHOOD,
) -> float:
    """Return the log of how much likelier the gesture is if this object is meant than if it means nothing.

    A mixture over the phrase's dwells; `stray` is the probability that the gesture is not about the phrase. Part of the
    error counts to the object's middle, so that among objects that are all hit the one squarely hit wins.
    """
    total = 0.0
    for index, (dwell, share) in enumerate(ray.dwells):
        e = errors[index]
        middle_z = min(e.z_centre, options.middle_max_z)
        squared_z = (1.0 - options.middle_share) * e.z**2 + options.middle_share * middle_z**2
        peak = np.sqrt(2.0 * np.pi) / dwell.sigma_rad  # of a normal over a uniform direction
        total += share * peak * float(np.exp(-0.5 * min(squared_z, options.max_squared_z)))
    return float(np.log(stray + (1.0 - stray) * total))


def intersect_table(
    ray: PhraseRay, surface: Surface, view: View, weights: Weights, options: TablePointOptions = TABLE_POINT
) -> TablePoint | None:
    """Return where the gesture meets the support, or None if it misses it.

    The ray is spread by its uncertainty into a fan; what falls on the outline gives mean and covariance.
    """
    if surface.polygon is None:
        return None
    outline = surface.polygon.buffer(options.outside_margin_m * surface.units_per_m)
    points, shares = [], []
    for dwell, share in ray.dwells:
        p, w = _intersect_fan(dwell, surface, view, weights, options)
        if len(p):
            inside = shapely.contains_xy(outline, p[:, 0], p[:, 1])
            points.append(p[inside])
            shares.append(share * w[inside])
    if not points:
        return None
    p, w = np.vstack(points), np.concatenate(shares)
    if w.sum() < options.min_weight:
        return None
    mean = np.average(p, axis=0, weights=w)
    spread = np.cov(p.T, aweights=w) if len(p) > 1 else np.zeros((2, 2))
    least = (weights.tip_sigma_m * surface.units_per_m) ** 2
    return TablePoint(mean, np.atleast_2d(spread) + least * np.eye(2))


def _intersect_fan(
    dwell: Dwell, surface: Surface, view: View, weights: Weights, options: TablePointOptions
) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 2) where rays around the dwell's meet the plane, and their probabilities (N,)."""
    steps = np.linspace(-options.fan_sigmas, options.fan_sigmas, options.fan_steps)
    if surface.metric and dwell.space is not None:
        u, across, along = _ray_axes(dwell.space)
        a, b = np.meshgrid(steps * dwell.sigma_rad, steps * dwell.sigma_rad * weights.depth_sigma_ratio)
        w = np.exp(-0.5 * ((a / dwell.sigma_rad) ** 2 + (b / (dwell.sigma_rad * weights.depth_sigma_ratio)) ** 2))
        d = u + np.tan(a).reshape(-1, 1) * across + np.tan(b).reshape(-1, 1) * along
        return _intersect_plane(dwell.space.tip, d, surface, w.ravel() / w.sum(), options.max_length_m)
    # Without depth the length of the ray is not known: people point from a few finger lengths away.
    lengths = dwell.finger_px * np.geomspace(options.min_fingers, options.max_fingers, options.finger_steps)
    off = np.log(lengths / (options.usual_fingers * dwell.finger_px)) / options.fingers_sigma
    prior = np.exp(-0.5 * off**2)
    a, r = np.meshgrid(steps * dwell.sigma_rad, lengths)
    w = (np.exp(-0.5 * (a / dwell.sigma_rad) ** 2) * prior[:, None]).ravel()
    base = float(np.arctan2(dwell.direction_px[1], dwell.direction_px[0]))
    turned = base + a.ravel()
    pixels = dwell.tip_px + r.reshape(-1, 1) * np.column_stack([np.cos(turned), np.sin(turned)])
    if not surface.metric:
        return pixels, w / w.sum()
    if view.camera is None or view.transform_camera_to_scene is None:
        return np.zeros((0, 2)), np.zeros(0)
    rays = view.camera.deproject(pixels, np.ones(len(pixels))) @ view.transform_camera_to_scene[:3, :3].T
    camera = view.transform_camera_to_scene[:3, 3]
    return _intersect_plane(camera, rays, surface, w / w.sum(), options.max_sight_m)


def _intersect_plane(
    origin: FloatArray, directions: FloatArray, surface: Surface, w: FloatArray, limit_m: float
) -> tuple[FloatArray, FloatArray]:
    """Return where rays from one point (3,) along directions (N, 3) meet the plane, and the weights of those that do.

    Rays that go away from the plane, or meet it farther than limit_m [m], are left out.
    """
    start = surface.to_plane(origin[None, :])[0]
    d = directions @ surface.scene_to_plane[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -start[2] / d[:, 2]
    ok = np.isfinite(t) & (t > 0.0) & (t * np.linalg.norm(d, axis=1) < limit_m)
    return start[:2] + t[ok, None] * d[ok, :2], w[ok]
