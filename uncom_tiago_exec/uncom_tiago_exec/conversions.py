# SPDX-License-Identifier: Apache-2.0
"""Messages of doing to values and back."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from geometry_msgs.msg import Polygon
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from uncom_common.conversions import duration_to_msg, matrix_from_pose_msg, seconds_from_msg, vector_from_msg
from uncom_perception.conversions import detection_from_msg
from uncom_perception.types import Scene
from uncom_perception.types import TableSurface as Table

from uncom_interfaces.msg import ExecutionStatus, GroundedCommand, GroundedTarget, TableSurface
from uncom_interfaces.srv import Detect
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage, Status, Trajectory


def polygon_from_msg(msg: Polygon) -> FloatArray:
    """Read an outline as points (N, 3) [m]."""
    return np.array([[p.x, p.y, p.z] for p in msg.points], dtype=float).reshape(-1, 3)


def table_from_msg(msg: TableSurface) -> Table | None:
    """Read a table; None if none was found."""
    if not msg.found or len(msg.polygon.points) < 3:
        return None
    polygon = polygon_from_msg(msg.polygon)
    if not np.any(polygon[:, 2]):
        polygon[:, 2] = msg.height
    return Table(polygon, vector_from_msg(msg.normal), polygon_from_msg(msg.image_polygon)[:, :2])


def task_from_msg(msg: GroundedCommand) -> ManipulationTask:
    """Read a grounded command as a task."""
    kind = msg.target.kind
    target = detection_from_msg(msg.target.object) if kind == GroundedTarget.OBJECT else None
    pose = None
    if kind != GroundedTarget.NONE:
        pose = matrix_from_pose_msg(msg.target.pose) if _has_pose(msg.target) else None
        if pose is None and len(msg.target.area.points) >= 3:
            pose = np.eye(4)
            pose[:3, 3] = polygon_from_msg(msg.target.area).mean(axis=0)
    return ManipulationTask(
        utterance_id=msg.utterance_id,
        index=int(msg.index),
        primitive=msg.primitive,
        relation=msg.relation,
        object=detection_from_msg(msg.object),
        scene=tuple(detection_from_msg(d) for d in msg.scene),
        table=table_from_msg(msg.table),
        target=target,
        target_pose=pose,
        object_text=msg.object_text,
        target_text=msg.target_text,
    )


def _has_pose(target: GroundedTarget) -> bool:
    p = target.pose.position
    return bool(p.x or p.y or p.z)


def scene_from_response(msg: Detect.Response) -> Scene:
    """Read what the detector answered."""
    return Scene(
        seconds_from_msg(msg.header.stamp),
        msg.header.frame_id,
        tuple(detection_from_msg(d) for d in msg.detections),
        table_from_msg(msg.table),
        tuple(float(p) for p in msg.phrase_none),
        msg.backend,
        float(msg.latency_s),
    )


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
    return FollowJointTrajectory.Goal(trajectory=message, goal_time_tolerance=Duration(sec=2))


def trajectory_from_msg(msg: JointTrajectory) -> Trajectory:
    """Read a trajectory."""
    return Trajectory(
        tuple(msg.joint_names),
        np.array([seconds_from_msg(p.time_from_start) for p in msg.points]),
        np.array([list(p.positions) for p in msg.points], dtype=float),
        np.array([list(p.velocities) for p in msg.points], dtype=float),
    )
