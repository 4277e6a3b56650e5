# SPDX-License-Identifier: Apache-2.0
"""What the camera sees of the robot itself and of what it holds, when an arm was left over the table: no obstacles."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from uncom_common.transforms import invert
from uncom_perception.types import Detection

from uncom_tiago_exec.observation.object_reidentification import objects_out_of_sight
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import attach
from uncom_tiago_exec.types import FloatArray, ManipulationTask

_AROUND = 0.025  # [m] around a link's box, for what the camera gets wrong
_MOST = 0.5  # share of a thing's points that are the robot's


@dataclass(frozen=True, slots=True)
class RobotBoxes:
    """Boxes: inverse poses (N, 4, 4) in base_footprint, and their middles and half sizes (N, 3) [m]."""

    inverses: FloatArray
    middles: FloatArray
    halves: FloatArray

    def share(self, cloud: FloatArray) -> float:
        """Return which share of points (M, 3) lies in one of the boxes, or nearly."""
        if len(cloud) == 0:
            return 0.0
        points = np.column_stack([cloud, np.ones(len(cloud))])
        inside = np.zeros(len(cloud), dtype=bool)
        for inverse, middle, half in zip(self.inverses, self.middles, self.halves, strict=True):
            inside |= (np.abs(points @ inverse[:3].T - middle) <= half + _AROUND).all(axis=1)
        return float(inside.mean())

    def among(self, things: Iterable[Detection]) -> frozenset[str]:
        """Return the ids of the things that are a part of the robot, or in its hand."""
        return frozenset(
            thing.id
            for thing in things
            if thing.geometry is not None and self.share(np.asarray(thing.geometry.cloud, dtype=float)) > _MOST
        )


def robot_boxes(robot: RobotModel, positions: Mapping[str, float], held: Plan | None = None) -> RobotBoxes:
    """Return the boxes around all links at joint positions, and around what a plan has put into the hand."""
    data, shapes = robot.model.createData(), robot.geometry.createData()
    pin.forwardKinematics(robot.model, data, robot.configuration(positions))
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, shapes)
    boxes = []
    for i, link in enumerate(robot.geometry.geometryObjects):
        link.geometry.computeLocalAABB()
        low, high = (np.array(corner) for corner in (link.geometry.aabb_local.min_, link.geometry.aabb_local.max_))
        boxes.append((np.array(shapes.oMg[i].homogeneous), 0.5 * (low + high), 0.5 * (high - low)))
    if held is not None and held.grasp is not None:
        group = robot.group(held.side, positions)
        hand = group.forward(group.vector(positions))
        parts = attach(held.scene.moved_solids, held.grasp.pose).parts
        boxes += [(hand @ part.pose, np.zeros(3), 0.5 * np.array(part.size)) for part in parts]
    poses, middles, halves = zip(*boxes, strict=True)
    return RobotBoxes(np.array([invert(pose) for pose in poses]), np.array(middles), np.array(halves))


def without_detections(task: ManipulationTask, own: Container[str]) -> ManipulationTask:
    """Return the task without the sightings of some ids among the other things: those of the robot itself."""
    return replace(task, scene=tuple(thing for thing in task.scene if thing.id not in own))


def task_with_held_object(task: ManipulationTask, before: ManipulationTask, own: Container[str]) -> ManipulationTask:
    """Return a task whose object is in the hand: it is the one of the task before, seen before it was taken.

    Whatever is named as the object now is the thing in the hand (its id is among the robot's own), or another one that
    stays where it is. What the arm hides now, or hides in part, stands where it was seen before.
    """
    seen = [thing for thing in _distinct((*task.scene, task.object)) if thing.id not in own]
    held = replace(before.object, id="held")
    scene = (*seen, *objects_out_of_sight(before, seen, task.target))
    return replace(task, object=held, scene=scene, table=before.table or task.table)


def _distinct(things: Iterable[Detection]) -> list[Detection]:
    return list({thing.id: thing for thing in things if thing.geometry is not None}.values())
