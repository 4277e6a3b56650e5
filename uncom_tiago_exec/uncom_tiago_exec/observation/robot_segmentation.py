# SPDX-License-Identifier: Apache-2.0
"""What the camera sees of the robot itself and of what it holds: where an arm was left over the table, no obstacles."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from uncom_common.transforms import invert
from uncom_perception.types import Detection

from uncom_tiago_exec.observation.detection_geometry import points_of
from uncom_tiago_exec.observation.object_reidentification import objects_out_of_sight
from uncom_tiago_exec.observation.options import ROBOT_SEGMENTATION, RobotSegmentationOptions
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import attach
from uncom_tiago_exec.types import FloatArray, ManipulationTask


@dataclass(frozen=True, slots=True)
class RobotBoxes:
    """Boxes around the links of a robot, and around what it holds.

    Attributes:
        inverses: inverse poses of their frames in base_footprint (N, 4, 4).
        centres: in those frames (N, 3) [m].
        half_sizes: along the axes of those frames (N, 3) [m].
        options: of segmentation.
    """

    inverses: FloatArray
    centres: FloatArray
    half_sizes: FloatArray
    options: RobotSegmentationOptions = ROBOT_SEGMENTATION

    def share(self, cloud: FloatArray) -> float:
        """Return which share of points (M, 3) lies in one of the boxes, or nearly."""
        if len(cloud) == 0:
            return 0.0
        points = np.column_stack([cloud, np.ones(len(cloud))])
        inside = np.zeros(len(cloud), dtype=bool)
        margin = self.options.margin_m
        for inverse, centre, half in zip(self.inverses, self.centres, self.half_sizes, strict=True):
            inside |= (np.abs(points @ inverse[:3].T - centre) <= half + margin).all(axis=1)
        return float(inside.mean())

    def among(self, detections: Iterable[Detection]) -> frozenset[str]:
        """Return the ids of the detections in base_footprint that are a part of the robot, or in its hand."""
        return frozenset(d.id for d in detections if self.share(points_of([d])) > self.options.own_points_ratio)


def robot_boxes(
    robot: RobotModel,
    positions: Mapping[str, float],
    held: Plan | None = None,
    options: RobotSegmentationOptions = ROBOT_SEGMENTATION,
) -> RobotBoxes:
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
    poses, centres, half_sizes = zip(*boxes, strict=True)
    return RobotBoxes(np.array([invert(pose) for pose in poses]), np.array(centres), np.array(half_sizes), options)


def without_detections(task: ManipulationTask, own: Container[str]) -> ManipulationTask:
    """Return a task without detections of some ids among the other objects: those of the robot itself."""
    return replace(task, scene=tuple(d for d in task.scene if d.id not in own))


def task_with_held_object(task: ManipulationTask, before: ManipulationTask, own: Container[str]) -> ManipulationTask:
    """Return a task whose object is in the hand: it is that of an earlier task, as it was seen before it was taken.

    What the arm hides now, or hides in part, stands where it was seen before.

    Args:
        task: what is to be done now. Whatever it names as the object is the one in the hand (its id is among the
            robot's own), or another one that stays where it is.
        before: the task that has put the object into the hand, in the same frame.
        own: ids of what is seen of the robot itself and of what it holds.
    """
    seen = [d for d in _distinct((*task.scene, task.object)) if d.id not in own]
    held = replace(before.object, id="held")
    scene = (*seen, *objects_out_of_sight(before, seen, task.target))
    return replace(task, object=held, scene=scene, table=before.table or task.table)


def _distinct(detections: Iterable[Detection]) -> list[Detection]:
    """Return the detections with depth, one an id."""
    return list({d.id: d for d in detections if d.geometry is not None}.values())
