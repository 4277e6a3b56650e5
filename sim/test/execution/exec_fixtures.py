# SPDX-License-Identifier: Apache-2.0
"""What the tests of this package share: the robot at its start pose, objects as a camera sees them, an easy robot."""

from __future__ import annotations

from functools import cache

import numpy as np
from uncom_common.primitive import Primitive
from uncom_sim.bench_planning.scenes import TABLE_Z, detection, flat_table
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.exceptions import StoppedError
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.types import BasePose, ManipulationTask

CAMERA = np.array([0.22, 0.0, 1.42])


@cache
def robot() -> RobotModel:
    return RobotModel(tiago_urdf())


def start_positions() -> dict[str, float]:
    return home_positions(0.35, (0.0, -0.95), 0.02)


def _standing(points, normals, x, y, yaw, rng):
    """Put points (N, 3) on the table and keep those whose surface faces the camera, with 1 mm of noise."""
    pose = make_upright_pose(np.array([x, y, TABLE_Z]), yaw)
    world = points @ pose[:3, :3].T + pose[:3, 3]
    facing = ((CAMERA - world) * (normals @ pose[:3, :3].T)).sum(axis=1) > 0
    return world[facing] + rng.normal(scale=0.001, size=(int(facing.sum()), 3))


def box_cloud(x, y, yaw, size, rng, count=6000):
    points, normals = [], []
    areas = [(size[1] * size[2], 0), (size[0] * size[2], 1), (size[0] * size[1], 2)]
    for area, axis in areas:
        for sign in (-1.0, 1.0):
            n = int(count * area / sum(a for a, _ in areas) / 2)
            p = rng.uniform(-0.5, 0.5, (n, 3)) * size
            p[:, axis] = sign * size[axis] / 2
            normal = np.zeros((n, 3))
            normal[:, axis] = sign
            points.append(p + np.array([0, 0, size[2] / 2]))
            normals.append(normal)
    return _standing(np.vstack(points), np.vstack(normals), x, y, yaw, rng)


def cylinder_cloud(x, y, radius, height, rng, count=5000):
    angle = rng.uniform(-np.pi, np.pi, count)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    side = ring * radius + np.column_stack([np.zeros((count, 2)), rng.uniform(0, height, count)])
    r = radius * np.sqrt(rng.uniform(0, 1, count // 2))
    top = np.column_stack([r * ring[: count // 2, 0], r * ring[: count // 2, 1], np.full(count // 2, height)])
    normals = np.vstack([ring, np.tile([0.0, 0.0, 1.0], (count // 2, 1))])
    return _standing(np.vstack([side, top]), normals, x, y, 0.0, rng)


def ball_cloud(x, y, radius, rng, count=4000):
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return _standing(n * radius + [0, 0, radius], n, x, y, 0.0, rng)


def bowl_cloud(x, y, radius, height, rng, count=9000):
    """A hemispherical-ish bowl 4 mm thick: inside and outside of a cone frustum, and its floor."""
    t, angle = rng.uniform(0, 1, count), rng.uniform(-np.pi, np.pi, count)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    clouds = []
    for inset, sign in ((0.0, 1.0), (0.004, -1.0)):
        r = radius * (0.5 + 0.5 * t) - inset
        points = np.column_stack([ring * r[:, None], 0.005 + (height - 0.005) * t])
        normal = np.column_stack([sign * ring * 0.8, np.full(count, -sign * 0.6)])
        clouds.append((points, normal))
    r = radius * 0.5 * np.sqrt(rng.uniform(0, 1, count // 3))
    floor = np.column_stack([ring[: count // 3] * r[:, None], np.full(count // 3, 0.006)])
    clouds.append((floor, np.tile([0.0, 0.0, 1.0], (count // 3, 1))))
    cloud = _standing(np.vstack([c for c, _ in clouds]), np.vstack([n for _, n in clouds]), x, y, 0.0, rng)
    # the near wall hides the near part of the floor and of the inside
    offset = cloud - [x, y, TABLE_Z]
    hidden = (
        (offset[:, 0] < -0.3 * radius)
        & (np.linalg.norm(offset[:, :2], axis=1) < 0.8 * radius * (0.5 + 0.5 * offset[:, 2] / height))
        & (offset[:, 2] < 0.4 * height)
    )
    return cloud[~hidden]


def dish_cloud(x, y, radius, height, rng, count=9000):
    """A flat dish: its floor 5 mm up and a border that rises outwards."""
    r, angle = radius * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(-np.pi, np.pi, count)
    z = np.where(r < 0.65 * radius, 0.005, 0.005 + (height - 0.005) * (r / radius - 0.65) / 0.35)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    return _standing(points, np.tile([0.0, 0.0, 1.0], (count, 1)), x, y, 0.0, rng)


def make_task(things, primitive, target=None, place=None, relation="none"):
    """Move the first of the detections to the target's name or to a place (x, y)."""
    pose = None if place is None else make_upright_pose(np.array([place[0], place[1], TABLE_Z]), 0.0)
    goal = next((d for d in things if d.id == target), None)
    return ManipulationTask(
        "u1",
        0,
        Primitive(primitive),
        relation,
        things[0],
        tuple(things),
        flat_table(),
        goal,
        pose,
        things[0].label,
        target or "",
    )


def lemon_and_bowl(rng, lemon=(0.6, 0.2)):
    return [
        detection("lemon", ball_cloud(*lemon, 0.027, rng)),
        detection("bowl", bowl_cloud(0.6, -0.08, 0.08, 0.065, rng)),
        detection("box", box_cloud(0.75, 0.2, 0.3, np.array([0.15, 0.08, 0.09]), rng)),
    ]


class ObedientRobot(RobotInterface):
    """Joints go where they are sent; between the fingers is something `width` wide, or nothing."""

    def __init__(self, scene, widths, stop_at=None):
        self.joints = start_positions()
        self.scene = scene
        self.widths = list(widths)
        self.stop_at = stop_at
        self.moves = 0
        self.base = BasePose()

    def positions(self):
        return dict(self.joints)

    def base_pose(self):
        return self.base

    def follow(self, trajectory):
        self.moves += 1
        if self.stop_at == self.moves:
            raise StoppedError("stopped on request")
        here = np.array([self.joints[n] for n in trajectory.joint_names])
        assert np.abs(here - trajectory.positions[0]).max() < 0.01, "a motion must start where the robot is"
        self.joints |= dict(zip(trajectory.joint_names, trajectory.positions[-1], strict=True))

    def grip(self, side, gap):
        gap = max(gap, self.widths[0]) if gap < 0.045 else gap
        for finger in ("left", "right"):
            self.joints[f"gripper_{side}_{finger}_finger_joint"] = gap / 2
        return gap

    def look(self):
        self.widths = self.widths[1:] or self.widths
        return self.scene


class DrivingRobot(ObedientRobot):
    """Drives as far as it is told, and remembers how far that was each time."""

    def __init__(self, scene, widths):
        super().__init__(scene, widths)
        self.driven = []

    def drive(self, distance):
        self.base = self.base.driven(distance)
        self.driven.append(distance)


class LookingOn(ObedientRobot):
    """Shows one scene after the other, the last one from then on."""

    def __init__(self, scenes, widths):
        super().__init__(scenes[0], widths)
        self.scenes = list(scenes)

    def look(self):
        self.scene = self.scenes.pop(0) if self.scenes else self.scene
        return self.scene
