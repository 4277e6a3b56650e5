# SPDX-License-Identifier: Apache-2.0
"""Messages of execution to values and back."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from uncom_common.conversions import duration_to_msg, matrix_from_pose_msg, primitive_from_msg, seconds_from_msg
from uncom_perception.conversions import detection_from_msg, polygon_from_msg, table_from_msg

from uncom_interfaces.msg import ExecutionStatus, GroundedCommand, GroundedTarget
from uncom_tiago_exec.types import BasePose, FloatArray, ManipulationTask, Stage, Status, Trajectory

_POLYGON_CORNERS = 3  # an area has at least so many
_DETERMINERS = {"this", "that", "these", "those", "the", "a", "an", "it", "them", "here", "there", "one"}


def base_pose_from_matrix(matrix: FloatArray) -> BasePose:
    """Read a transform (4, 4) from base_footprint to odom as the pose of a base that stands upright."""
    yaw = float(np.arctan2(matrix[1, 0], matrix[0, 0]))
    return BasePose(float(matrix[0, 3]), float(matrix[1, 3]), yaw)


def task_from_msg(msg: GroundedCommand) -> ManipulationTask:
    """Read a grounded command as a task in the frame of its header.

    Raises:
        UnknownPrimitiveError: the primitive is not one of the constants.
    """
    kind = msg.target.kind
    target = detection_from_msg(msg.target.object) if kind == GroundedTarget.OBJECT else None
    pose = None
    if kind != GroundedTarget.NONE:
        pose = matrix_from_pose_msg(msg.target.pose) if _has_pose(msg.target) else None
        if pose is None and len(msg.target.area.points) >= _POLYGON_CORNERS:
            pose = np.eye(4)
            pose[:3, 3] = polygon_from_msg(msg.target.area).mean(axis=0)
    return ManipulationTask(
        utterance_id=msg.utterance_id,
        index=int(msg.index),
        primitive=primitive_from_msg(msg.primitive),
        relation=msg.relation,
        object=detection_from_msg(msg.object),
        scene=tuple(detection_from_msg(d) for d in msg.scene),
        table=table_from_msg(msg.table),
        target=target,
        target_pose=pose,
        object_text=_noun(msg.object_text, msg.object.label),
        target_text=_noun(msg.target_text, msg.target.object.label),
    )


def _noun(text: str, label: str) -> str:
    """Return the words for an object without its determiner; the label where only "this" or "here" was said."""
    words = text.split()
    while words and words[0].lower() in _DETERMINERS:
        words = words[1:]
    return " ".join(words) or label


def _has_pose(target: GroundedTarget) -> bool:
    p = target.pose.position
    return bool(p.x or p.y or p.z)


def status_to_msg(status: Status, header: Header, utterance_id: str, index: int) -> ExecutionStatus:
    """Write a status."""
    return ExecutionStatus(
        header=header,
        utterance_id=utterance_id,
        index=index,
        stage=int(status.stage),
        stage_name=status.stage.name,
        arm=status.arm,
        detail=status.detail,
        data_json=json.dumps(status.data) if status.data else "",
    )


def status_from_msg(msg: ExecutionStatus) -> Status:
    """Read a status."""
    return Status(Stage(msg.stage), msg.detail, msg.arm, json.loads(msg.data_json) if msg.data_json else {})


def goal_to_msg(trajectory: Trajectory, joints: tuple[str, ...]) -> Any:
    """Write the part of a trajectory that concerns some joints as a goal of their controller."""
    columns = [trajectory.joint_names.index(name) for name in joints]
    message = JointTrajectory(joint_names=list(joints))
    for time_s, q, v in zip(trajectory.times, trajectory.positions, trajectory.velocities, strict=True):
        point = JointTrajectoryPoint(time_from_start=duration_to_msg(float(time_s)))
        point.positions = [float(q[i]) for i in columns]
        point.velocities = [float(v[i]) for i in columns]
        message.points.append(point)
    goal = FollowJointTrajectory.Goal(trajectory=message, goal_time_tolerance=Duration(sec=2))
    if trajectory.tolerance > 0.0:
        goal.path_tolerance = [JointTolerance(name=name, position=trajectory.tolerance) for name in joints]
    return goal


def trajectory_from_msg(msg: JointTrajectory) -> Trajectory:
    """Read a trajectory."""
    return Trajectory(
        tuple(msg.joint_names),
        np.array([seconds_from_msg(p.time_from_start) for p in msg.points]),
        np.array([list(p.positions) for p in msg.points], dtype=float),
        np.array([list(p.velocities) for p in msg.points], dtype=float),
    )
