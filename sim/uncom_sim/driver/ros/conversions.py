# SPDX-License-Identifier: Apache-2.0
"""The simulator's values as messages, and the robot's commands as values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from audio_common_msgs.msg import AudioData, AudioDataStamped, AudioInfo
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance, JointTrajectoryControllerState
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import JointState as JointStateMsg
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from uncom_common.conversions import (
    duration_to_msg,
    header_to_msg,
    matrix_from_pose_msg,
    pose_to_msg,
    seconds_from_msg,
    time_to_msg,
    vector_from_msg,
    vector_to_msg,
)
from uncom_common.transforms import FloatArray

from uncom_interfaces.msg import SimObject, SimState
from uncom_sim.controllers.diff_drive import Odometry
from uncom_sim.controllers.joint_trajectory import Outcome
from uncom_sim.controllers.tolerances import GoalTolerances, Tolerance
from uncom_sim.controllers.trajectory import SetPoint, Trajectory, Waypoint
from uncom_sim.types import SAMPLE_RATE_HZ, ObjectState, SpokenWord
from uncom_sim.world.simulator_types import Frames, JointState

_COVARIANCE = np.diag((0.001, 0.001, 0.001, 0.001, 0.001, 0.01)).reshape(-1)


def joint_state_to_msg(state: JointState, stamp_s: float) -> JointStateMsg:
    """Write the joints' states."""
    return JointStateMsg(
        header=header_to_msg(stamp_s, ""),
        name=list(state.names),
        position=state.positions.tolist(),
        velocity=state.velocities.tolist(),
        effort=state.efforts.tolist(),
    )


def frames_to_msg(frames: Frames, stamp_s: float, reuse: TFMessage | None = None) -> TFMessage:
    """Write transforms; a message of the same frames may be written over, which costs half as much."""
    stamp = time_to_msg(stamp_s)
    messages = [] if reuse is None else reuse.transforms
    if reuse is None:
        for parent, child in zip(frames.parents, frames.children, strict=True):
            messages.append(TransformStamped(header=Header(frame_id=parent), child_frame_id=child))
    values = zip(messages, frames.places.tolist(), frames.quaternions.tolist(), strict=True)
    for msg, place, quaternion in values:
        msg.header.stamp = stamp
        translation, rotation = msg.transform.translation, msg.transform.rotation
        translation.x, translation.y, translation.z = place
        rotation.x, rotation.y, rotation.z, rotation.w = quaternion
    return TFMessage(transforms=messages) if reuse is None else reuse


def odometry_to_msg(odometry: Odometry, stamp_s: float) -> OdometryMsg:
    """Write the odometry of the base."""
    msg = OdometryMsg(header=header_to_msg(stamp_s, "odom"), child_frame_id="base_footprint")
    half = odometry.yaw / 2.0
    position, orientation = msg.pose.pose.position, msg.pose.pose.orientation
    position.x, position.y = odometry.x, odometry.y
    orientation.z, orientation.w = float(np.sin(half)), float(np.cos(half))
    msg.twist.twist.linear.x = odometry.linear
    msg.twist.twist.angular.z = odometry.angular
    msg.pose.covariance = _COVARIANCE
    msg.twist.covariance = _COVARIANCE
    return msg


def audio_to_msg(samples: npt.NDArray[np.int16], stamp_s: float) -> AudioDataStamped:
    """Write sound as S16LE; the stamp is that of the first sample."""
    data = AudioData(data=samples.astype("<i2").tobytes())
    return AudioDataStamped(header=header_to_msg(stamp_s, "head_front_camera_link"), audio=data)


def audio_info_to_msg() -> AudioInfo:
    """Write what the sound is: mono, 16 kHz, S16LE."""
    return AudioInfo(
        channels=1,
        sample_rate=SAMPLE_RATE_HZ,
        sample_format="S16LE",
        bitrate=16 * SAMPLE_RATE_HZ,
        coding_format="wave",
    )


def trajectory_from_msg(msg: JointTrajectory) -> Trajectory:
    """Read a trajectory; what is wrong with it is found by `trajectory.check`."""

    def values(numbers: Sequence[float]) -> FloatArray | None:
        return np.array(numbers, dtype=float) if len(numbers) else None

    points = tuple(
        Waypoint(
            seconds_from_msg(point.time_from_start),
            np.array(point.positions, dtype=float),
            values(point.velocities),
            values(point.accelerations),
        )
        for point in msg.points
    )
    return Trajectory(tuple(msg.joint_names), points, seconds_from_msg(msg.header.stamp))


def trajectory_to_msg(trajectory: Trajectory) -> JointTrajectory:
    """Write a trajectory."""
    msg = JointTrajectory(header=header_to_msg(trajectory.start_s, ""), joint_names=list(trajectory.joints))
    for point in trajectory.points:
        written = JointTrajectoryPoint(
            positions=point.positions.tolist(), time_from_start=duration_to_msg(point.time_s)
        )
        if point.velocities is not None:
            written.velocities = point.velocities.tolist()
        if point.accelerations is not None:
            written.accelerations = point.accelerations.tolist()
        msg.points.append(written)
    return msg


def tolerances_from_msg(goal: FollowJointTrajectory.Goal) -> GoalTolerances:
    """Read the tolerances of an action goal."""

    def named(tolerances: Sequence[JointTolerance]) -> dict[str, Tolerance]:
        return {t.name: Tolerance(t.position, t.velocity, t.acceleration) for t in tolerances}

    return GoalTolerances(
        path=named(goal.path_tolerance),
        goal=named(goal.goal_tolerance),
        goal_time_s=seconds_from_msg(goal.goal_time_tolerance),
    )


def result_to_msg(outcome: Outcome) -> FollowJointTrajectory.Result:
    """Write how an action goal ended."""
    return FollowJointTrajectory.Result(error_code=int(outcome.code), error_string=outcome.text)


def _point(positions: FloatArray, velocities: FloatArray) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(positions=positions.tolist(), velocities=velocities.tolist())


def feedback_to_msg(
    joints: Sequence[str], desired: SetPoint, position: FloatArray, velocity: FloatArray, stamp_s: float
) -> FollowJointTrajectory.Feedback:
    """Write how an action goal goes on."""
    return FollowJointTrajectory.Feedback(
        header=header_to_msg(stamp_s, ""),
        joint_names=list(joints),
        desired=_point(desired.positions, desired.velocities),
        actual=_point(position, velocity),
        error=_point(desired.positions - position, desired.velocities - velocity),
    )


def controller_state_to_msg(
    joints: Sequence[str], desired: SetPoint, position: FloatArray, velocity: FloatArray, stamp_s: float
) -> JointTrajectoryControllerState:
    """Write a controller's state."""
    return JointTrajectoryControllerState(
        header=header_to_msg(stamp_s, ""),
        joint_names=list(joints),
        reference=_point(desired.positions, desired.velocities),
        feedback=_point(position, velocity),
        error=_point(desired.positions - position, desired.velocities - velocity),
        output=_point(desired.positions, desired.velocities),
        speed_scaling_factor=1.0,
    )


def sim_state_to_msg(
    objects: Sequence[ObjectState],
    words: Sequence[SpokenWord],
    stamp_s: float,
    contacts: tuple[int, int],
    *,
    person_done: bool,
) -> SimState:
    """Write the truth for the scorer; contacts are those of the robot with table and bystanders."""
    return SimState(
        header=header_to_msg(stamp_s, "base_footprint"),
        objects=[
            SimObject(id=o.id, kind=o.kind, colour=o.colour, pose=pose_to_msg(o.pose), size=vector_to_msg(o.size))
            for o in objects
        ],
        robot_table_contacts=contacts[0],
        robot_bystander_contacts=contacts[1],
        person_done=person_done,
        words=[word.text for word in words],
        word_starts=[word.start_s for word in words],
        word_ends=[word.end_s for word in words],
    )


def object_states_from_msg(msg: SimState) -> tuple[ObjectState, ...]:
    """Read where the objects are."""
    return tuple(
        ObjectState(obj.id, obj.kind, obj.colour, matrix_from_pose_msg(obj.pose), vector_from_msg(obj.size))
        for obj in msg.objects
    )
