# SPDX-License-Identifier: Apache-2.0
"""Pictures to look at, rendered for the tests: the simulated world, and a plain table made of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pybullet
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import invert
from uncom_sim.world.scene_file import scene_from_dict
from uncom_sim.world.world import World

NEAR_M, FAR_M = 0.05, 12.0
CAMERA = PinholeCamera(640, 480, 522.19, 522.19, 320.5, 240.5)
FRAME = "head_front_camera_rgb_optical_frame"


def camera_pose(pitch=0.95, position=(0.216, 0.0, 1.4165)):
    """Pose (4, 4) in the base frame of a camera that looks ahead and down by pitch [rad]."""
    forward = np.array([np.cos(pitch), 0.0, -np.sin(pitch)])
    right = np.array([0.0, -1.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = position
    return pose


POSE = camera_pose()


@dataclass(frozen=True)
class Take:
    """One picture with its truth: masks by object id, kinds, and the person's 21 joints in the base frame (or None)."""

    rgb: np.ndarray
    depth: np.ndarray
    masks: dict
    kinds: dict
    colours: dict
    places: dict
    hand_mask: np.ndarray
    joints: np.ndarray | None


def takes(scene, seed=0, times=(None,)):
    """Render a scene (as a dict) at times of the person's performance; "object", "target": while pointing there."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setTimeStep(1.0 / 240.0, physicsClientId=client)
        world = World(client, scene_from_dict(scene), seed)
        world.settle()
        rng = np.random.default_rng(seed)
        return [_take(client, world, rng, when) for when in times]
    finally:
        pybullet.disconnect(client)


def _take(client, world, rng, when):
    t_s = when
    if isinstance(when, str):
        pointing = next(p for p in world.person.pointing if p.role == when)
        t_s = 0.5 * (pointing.start_s + pointing.end_s)
    world.update_person(t_s)
    hand = None if t_s is None else world.person.hand_at(t_s)
    joints = None if hand is None else world.person.hand.joints @ hand[:3, :3].T + hand[:3, 3]
    rgb, depth, bodies = _render(client, world.light)
    states = {s.id: s for s in world.object_states()}
    return Take(
        np.clip(rgb + rng.normal(0.0, 1.8, rgb.shape), 0, 255).astype(np.uint8),
        _as_sensed(depth, rng),
        {name: bodies == body for name, body in world.object_bodies.items()},
        {name: s.kind for name, s in states.items()},
        {name: s.colour for name, s in states.items()},
        {name: s.position for name, s in states.items()},
        bodies == world.hand_body,
        joints,
    )


def _render(client, light):
    """Return colour, depth [m] and body ids as PyBullet's own renderer draws them."""
    c = CAMERA
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2.0 * c.fx / c.width, 1.0 - 2.0 * c.cx / c.width
    matrix[1, 1], matrix[1, 2] = 2.0 * c.fy / c.height, 2.0 * (c.cy + 1.0) / c.height - 1.0
    matrix[2, 2:] = -(FAR_M + NEAR_M) / (FAR_M - NEAR_M), -2.0 * FAR_M * NEAR_M / (FAR_M - NEAR_M)
    matrix[3, 2] = -1.0
    view = np.diag([1.0, -1.0, -1.0, 1.0]) @ invert(POSE)
    _, _, pixels, buffer, ids = pybullet.getCameraImage(
        c.width,
        c.height,
        view.T.ravel().tolist(),
        matrix.T.ravel().tolist(),
        lightDirection=list(light.direction),
        lightColor=list(light.colour),
        lightDistance=light.distance,
        lightAmbientCoeff=light.ambient,
        lightDiffuseCoeff=light.diffuse,
        lightSpecularCoeff=light.specular,
        shadow=1,
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )
    z = np.reshape(buffer, (c.height, c.width)).astype(float)
    bodies = np.reshape(ids, (c.height, c.width))
    rgb = np.reshape(pixels, (c.height, c.width, 4))[..., :3].astype(np.uint8)
    depth = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * z)
    return rgb, depth, np.where(bodies < 0, -1, bodies & ((1 << 24) - 1))


def _as_sensed(depth, rng):
    """Add noise of 1.5 mm at 1 m, and lose most of the pixels at edges."""
    jump = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3)))
    sensed = depth + rng.normal(0.0, 0.0015, depth.shape) * depth**2
    sensed[(jump > 0.02 * depth) & (rng.random(depth.shape) < 0.75)] = np.nan
    return sensed.astype(np.float32)


def overlap(a, b):
    """Intersection over union of two masks."""
    return float((a & b).sum() / max((a | b).sum(), 1))


def plain_table(height=0.72, noise_m=0.001, blocks=(), pose=POSE, seed=0):
    """Depth and colour of a level table (x 0.45..0.95, y -0.5..0.5) with blocks (x, y, sx, sy, sz, rgb), by rays."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
    rays = rays @ pose[:3, :3].T
    depth = np.full(u.shape, np.inf)
    rgb = np.full((*u.shape, 3), 120, np.uint8)
    solids = [(0.7, 0.0, 0.5, 1.0, -0.04, (150, 110, 70)), *blocks]
    for x, y, sx, sy, sz, colour in solids:
        low = np.array([x - sx / 2, y - sy / 2, height + min(sz, 0.0)]) - pose[:3, 3]
        high = np.array([x + sx / 2, y + sy / 2, height + max(sz, 0.0)]) - pose[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = low / rays, high / rays
        near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        hit = (near < far) & (near > 0) & (near < depth)
        depth[hit] = near[hit]
        rgb[hit] = colour
    floor = -pose[2, 3] / rays[..., 2]
    depth = np.where(np.isfinite(depth), depth, np.where(floor > 0, floor, np.nan))
    depth = depth + rng.normal(0.0, noise_m, depth.shape) * depth**2
    return rgb, depth.astype(np.float32)
