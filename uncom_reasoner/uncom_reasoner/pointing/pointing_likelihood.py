# SPDX-License-Identifier: Apache-2.0
"""How well a thing or a place fits a fused ray: forward only, finite, to the thing itself and not to its centre.

In space the error of a point is split into the part across the camera's line of sight (well seen) and the part along
it (from depth, less sure); without depth only the first is known. An error is counted in standard deviations (z), where
the fingertip's own uncertainty widens the cone near the hand. A ray that hits has z = 0, a thing behind the hand a
large one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from uncom_perception.types import Detection

from uncom_reasoner.support.support_plane import Surface
from uncom_reasoner.types import Dwell, FloatArray, PhraseRay, RayInSpace, TablePoint, View
from uncom_reasoner.weights import Weights

BEHIND_Z = 30.0
POINTS = 400  # of a thing, at most


@dataclass(frozen=True, slots=True)
class PointingError:
    """How far a thing is from a ray: z [standard deviations] of its nearest part, z of its middle."""

    z: float
    z_centre: float


def pointing_error(dwell: Dwell, detection: Detection, weights: Weights) -> PointingError:
    """Measure the error of a thing in space where ray and thing have depth, else in the image."""
    geometry = detection.geometry
    if dwell.space is not None and geometry is not None and len(geometry.cloud):
        cloud = geometry.cloud[:: max(1, len(geometry.cloud) // POINTS)].astype(float)
        z = _errors_in_space(dwell, dwell.space, np.vstack([cloud, geometry.centroid[None, :]]), weights)
    else:
        rows, columns = np.nonzero(detection.mask)
        box = detection.box
        if len(rows):
            step = max(1, len(rows) // POINTS)
            pixels = np.column_stack([columns, rows])[::step].astype(float)
        else:
            pixels = _box_outline(box.x_min, box.y_min, box.x_max, box.y_max)
        z = _errors_in_image(dwell, np.vstack([pixels, np.array(box.center)[None, :]]), weights)
    return PointingError(float(z.min()), float(z[-1]))


def _box_outline(x_min: float, y_min: float, x_max: float, y_max: float) -> FloatArray:
    u, v = np.meshgrid(np.linspace(x_min, x_max, 9), np.linspace(y_min, y_max, 9))
    return np.column_stack([u.ravel(), v.ravel()])


def _errors_in_image(dwell: Dwell, pixels: FloatArray, weights: Weights) -> FloatArray:
    d = dwell.direction_px
    v = pixels - dwell.tip_px
    r = np.maximum(np.linalg.norm(v, axis=1), 1e-6)
    angle = np.abs(np.arctan2(d[0] * v[:, 1] - d[1] * v[:, 0], v @ d))
    near = weights.tip_sigma_m * dwell.width / r  # a table about a metre away fills about the image
    z = angle / np.hypot(dwell.sigma_rad, near)
    return np.asarray(np.where(angle > np.pi / 2.0, np.maximum(z, np.minimum(BEHIND_Z, r / (0.02 * dwell.width))), z))


def _ray_axes(space: RayInSpace) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ray, the axis across the line of sight and the third one (unit vectors, scene frame)."""
    u = space.direction
    across = np.cross(space.tip - space.eye, u)
    norm = float(np.linalg.norm(across))
    if norm < 1e-6:  # the finger points along the line of sight: every side is alike
        across = np.cross(u, np.eye(3)[int(np.argmin(np.abs(u)))])
        norm = float(np.linalg.norm(across))
    across = across / norm
    return u, across, np.cross(across, u)


def _errors_in_space(dwell: Dwell, space: RayInSpace, points: FloatArray, weights: Weights) -> FloatArray:
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
    return np.asarray(np.where(behind, np.maximum(z, np.minimum(BEHIND_Z, r / weights.tip_sigma_m)), z))


def ray_log(ray: PhraseRay, errors: dict[int, PointingError], stray: float) -> float:
    """Return log of how much likelier the gesture is if this thing is meant than if it means nothing.

    A mixture over the phrase's dwells; `stray` is the probability that the gesture is not about the phrase. Part of the
    error counts to the thing's middle, so that among things that are all hit the one squarely hit wins.
    """
    total = 0.0
    for index, (dwell, share) in enumerate(ray.dwells):
        e = errors[index]
        z2 = 0.85 * e.z**2 + 0.15 * min(e.z_centre, 6.0) ** 2
        peak = np.sqrt(2.0 * np.pi) / dwell.sigma_rad  # of a normal over a uniform direction
        total += share * peak * float(np.exp(-0.5 * min(z2, 200.0)))
    return float(np.log(stray + (1.0 - stray) * total))


def table_point(ray: PhraseRay, surface: Surface, view: View, weights: Weights) -> TablePoint | None:
    """Return where the gesture meets the support, or None if it misses it.

    The ray is spread by its uncertainty into a fan; what falls on the outline gives mean and covariance.
    """
    if surface.polygon is None:
        return None
    points, shares = [], []
    for dwell, share in ray.dwells:
        p, w = _fan(dwell, surface, view, weights)
        if len(p):
            inside = shapely.contains_xy(surface.polygon.buffer(0.04 * surface.unit), p[:, 0], p[:, 1])
            points.append(p[inside])
            shares.append(share * w[inside])
    if not points:
        return None
    p, w = np.vstack(points), np.concatenate(shares)
    if w.sum() < 0.02:
        return None
    mean = np.average(p, axis=0, weights=w)
    spread = np.cov(p.T, aweights=w) if len(p) > 1 else np.zeros((2, 2))
    floor = (weights.tip_sigma_m * surface.unit) ** 2
    return TablePoint(mean, np.atleast_2d(spread) + floor * np.eye(2))


def _fan(dwell: Dwell, surface: Surface, view: View, weights: Weights) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 2) where rays around the dwell's meet the plane, and their probabilities (N,)."""
    steps = np.linspace(-2.0, 2.0, 9)
    if surface.metric and dwell.space is not None:
        u, across, along = _ray_axes(dwell.space)
        a, b = np.meshgrid(steps * dwell.sigma_rad, steps * dwell.sigma_rad * weights.depth_sigma_ratio)
        w = np.exp(-0.5 * ((a / dwell.sigma_rad) ** 2 + (b / (dwell.sigma_rad * weights.depth_sigma_ratio)) ** 2))
        d = u + np.tan(a).reshape(-1, 1) * across + np.tan(b).reshape(-1, 1) * along
        return _meet(dwell.space.tip, d, surface, w.ravel() / w.sum(), limit_m=1.2)
    # Without depth the length of the ray is not known: people point from a few finger lengths away.
    lengths = dwell.finger_px * np.geomspace(0.5, 12.0, 24)
    prior = np.exp(-0.5 * (np.log(lengths / (3.0 * dwell.finger_px)) / 0.7) ** 2)
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
    return _meet(view.transform_camera_to_scene[:3, 3], rays, surface, w / w.sum(), limit_m=10.0)


def _meet(
    origin: FloatArray, directions: FloatArray, surface: Surface, w: FloatArray, limit_m: float
) -> tuple[FloatArray, FloatArray]:
    start = surface.to_plane(origin[None, :])[0]
    d = directions @ surface.scene_to_plane[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -start[2] / d[:, 2]
    ok = np.isfinite(t) & (t > 0.0) & (t * np.linalg.norm(d, axis=1) < limit_m)
    return start[:2] + t[ok, None] * d[ok, :2], w[ok]
