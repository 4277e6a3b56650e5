# SPDX-License-Identifier: Apache-2.0
"""The execution node's access to the robot: joint states, controllers, camera. Called from the engine's thread only."""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

import numpy as np
from control_msgs.action import FollowJointTrajectory
from geometry_msgs.msg import TransformStamped
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage
from uncom_common.conversions import seconds_from_msg, stamped_transform_to_msg, stamped_transforms_from_msg
from uncom_common.exceptions import TransformError
from uncom_common.transforms import StampedTransform, TransformBuffer
from uncom_perception.conversions import scene_from_response
from uncom_perception.types import Scene

from uncom_interfaces.srv import Detect
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.conversions import base_pose_from_matrix, goal_to_msg
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.robot.gripper_joints import finger_gap, finger_motion
from uncom_tiago_exec.robot.joint_names import HEAD_JOINTS, TORSO_JOINT, arm_joints, finger_joints
from uncom_tiago_exec.ros.base_drive import drive_base
from uncom_tiago_exec.ros.debounce import Debounce
from uncom_tiago_exec.ros.patient_action_client import PatientActionClient
from uncom_tiago_exec.types import ODOM_ORIGIN, SIDES, BasePose, Side, Trajectory

CONTROLLERS: dict[str, tuple[str, ...]] = {
    "torso_controller": (TORSO_JOINT,),
    "head_controller": HEAD_JOINTS,
    **{f"arm_{side}_controller": arm_joints(side) for side in SIDES},
    **{f"gripper_{side}_controller": finger_joints(side) for side in SIDES},
}
_TICK_S = 0.02  # [s] how often a waiting thread looks at stop requests and silent joint states
_SURE_S = 0.2  # [s] of wall time that silence must last for, in which messages that wait are handled
_EXTRA_S = 5.0  # [s] a controller may take longer than its trajectory before it counts as stuck
_ACCEPT_S = 1.0  # [s] until a controller has taken a goal and tells how far it is
_STEP = 1e-5  # [rad or m] between two joint states that is a motion
_ARRIVED = 0.01  # [rad or m] from the end of its motion, where a joint need not move any more
_LOOK_S = 20.0  # [s] for a picture and its detections


class RosRobot(RobotInterface):
    """A robot behind ROS topics and actions."""

    def __init__(self, node: Node, config: ExecutionConfig) -> None:
        """Make subscriptions and clients on a node; nothing is waited for."""
        self._node = node
        self._config = config
        self._group = ReentrantCallbackGroup()
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._told = threading.Event()  # joint states have arrived
        self._stop = threading.Event()
        self._joints: dict[str, float] = {}
        self._joints_stamp = -np.inf
        self._goals: dict[str, Any] = {}
        self._images: dict[str, Any] = {}
        self._heard: dict[str, float] = {}  # when each controller last told how far it is
        self._moved: dict[str, float] = {}  # when each joint last moved
        self._tree = TransformBuffer()
        self._clients = {
            name: PatientActionClient(
                node, FollowJointTrajectory, f"/{name}/follow_joint_trajectory", callback_group=self._group
            )
            for name in CONTROLLERS
        }
        self._detect = node.create_client(Detect, "/uncom/detect", callback_group=self._group)
        self._subscribe()

    def _subscribe(self) -> None:
        node, group = self._node, self._group
        reliability = ReliabilityPolicy.RELIABLE if self._config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        images = QoSProfile(depth=2, reliability=reliability)
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        camera = "/head_front_camera"
        node.create_subscription(JointState, "/joint_states", self._on_joints, 10, callback_group=group)
        for topic, qos, static in (("/tf", 100, False), ("/tf_static", latched, True)):
            keep = partial(self._on_tf, static=static)
            node.create_subscription(TFMessage, topic, keep, qos, callback_group=group)
        for name, topic, kind in (
            ("rgb", f"{camera}/rgb/image_raw", Image),
            ("depth", f"{camera}/depth_registered/image_raw", Image),
            ("info", f"{camera}/rgb/camera_info", CameraInfo),
        ):
            node.create_subscription(kind, topic, self._keeper(name), images, callback_group=group)

    def _keeper(self, name: str) -> Any:
        def keep(msg: Any) -> None:
            with self._lock:
                self._images[name] = msg
            self._changed.set()

        return keep

    def _on_joints(self, msg: JointState) -> None:
        now = self._now()
        with self._lock:
            for name, position in zip(msg.name, msg.position, strict=False):
                if abs(position - self._joints.get(name, np.inf)) > _STEP:
                    self._moved[name] = now
                self._joints[name] = position
            self._joints_stamp = now
        self._told.set()

    def _on_tf(self, msg: TFMessage, *, static: bool) -> None:
        for transform in stamped_transforms_from_msg(msg.transforms):
            self._tree.add(transform, static=static)

    def _now(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def missing(self) -> list[str]:
        """Return the names of controllers that are not there (yet)."""
        return [name for name, client in self._clients.items() if not client.server_is_ready()]

    def positions(self) -> dict[str, float]:
        """Return joint positions; see RobotInterface."""
        quiet = Debounce(_SURE_S)
        while not self._alive():
            if quiet.holds(True):
                raise MotionError("no joint states arrive on /joint_states; is the robot running?")
            self._told.wait(_TICK_S)
            self._told.clear()
        with self._lock:
            return dict(self._joints)

    def halt(self) -> None:
        """Cancel every goal; calls in progress raise StoppedError until `resume`."""
        self._stop.set()
        with self._lock:
            goals = list(self._goals.values())
        for handle in goals:
            handle.cancel_goal_async()
        self._changed.set()

    def resume(self) -> None:
        """Allow motion again after a halt."""
        self._stop.clear()

    def follow(self, trajectory: Trajectory) -> None:
        """Send torso and arm their parts and wait for both; see RobotInterface."""
        for name, result in self._carry_out(_goals(trajectory)).items():
            if result.error_code != FollowJointTrajectory.Result.SUCCESSFUL:
                raise MotionError(f"{name} gave up: {result.error_string or result.error_code}")

    def grip(self, side: Side, gap: float) -> float:
        """Bring the fingers to a gap; see RobotInterface."""
        self._carry_out(_goals(finger_motion(side, gap, self.positions())))
        return finger_gap(side, self.positions())

    def base_pose(self, stamp_s: float | None = None) -> BasePose:
        """Return where the base stands, now or at a time [s]; see RobotInterface.

        Where a time is not known the latest pose is taken, and the origin where nothing publishes odom.
        """
        for moment in (stamp_s, None):
            try:
                matrix = self._tree.lookup(self._config.base_frame, self._config.odom_frame, moment)
            except TransformError:
                continue
            return base_pose_from_matrix(matrix)
        return ODOM_ORIGIN

    def drive(self, distance: float) -> None:
        """Drive the base by odometry; see RobotInterface."""
        drive_base(self._node, self._group, distance, self._stop, self._config.base_frame)

    def _carry_out(self, goals: dict[str, Any]) -> dict[str, Any]:
        """Send goals and wait for their results; cancel all on stop, silence or when one fails."""
        if self._stop.is_set():
            raise StoppedError("stopped")
        results: dict[str, Any] = {}
        done = threading.Event()
        duration = 0.0
        for name, goal in goals.items():
            if not self._clients[name].server_is_ready():
                raise MotionError(f"{name} is not running; start the robot's controllers")
            duration = max(duration, seconds_from_msg(goal.trajectory.points[-1].time_from_start))
            self._heard[name] = self._now() + _ACCEPT_S
            future = self._clients[name].send_goal_async(goal, feedback_callback=partial(self._on_feedback, name))
            future.add_done_callback(lambda f, n=name: self._accepted(n, f, results, done, len(goals)))
        ends_s = self._now() + duration
        deadline = ends_s + _EXTRA_S
        quiet = Debounce(_SURE_S)
        while not done.wait(_TICK_S):
            failed = [r for r in results.values() if r.error_code != FollowJointTrajectory.Result.SUCCESSFUL]
            silent = [
                name for name, goal in goals.items() if name not in results and self._is_silent(name, goal, ends_s)
            ]
            lost = quiet.holds(bool(silent) or not self._alive())
            if self._stop.is_set() or self._now() > deadline or failed or lost:
                self._cancel(goals)
                break
        with self._lock:
            for name in goals:
                self._goals.pop(name, None)
        if self._stop.is_set():
            raise StoppedError("stopped on request")
        if not done.is_set() and not any(r.error_code for r in results.values()):
            self.positions()  # says so if joint states fell silent
            if silent:
                raise MotionError(f"{', '.join(silent)} fell silent; are the robot's controllers running?")
            raise MotionError(f"{', '.join(goals)} did not finish in time")
        return results

    def _accepted(self, name: str, future: Any, results: dict[str, Any], done: threading.Event, count: int) -> None:
        handle = future.result()
        if not handle.accepted:
            refused = FollowJointTrajectory.Result(error_code=FollowJointTrajectory.Result.INVALID_GOAL)
            refused.error_string = "the goal was refused"
            self._finish(name, refused, results, done, count)
            return
        with self._lock:
            self._goals[name] = handle
        if self._stop.is_set():
            handle.cancel_goal_async()
        handle.get_result_async().add_done_callback(
            lambda f: self._finish(name, f.result().result, results, done, count)
        )

    def _finish(self, name: str, result: Any, results: dict[str, Any], done: threading.Event, count: int) -> None:
        with self._lock:
            results[name] = result
            complete = len(results) == count
        if complete:
            done.set()

    def _cancel(self, goals: dict[str, Any]) -> None:
        with self._lock:
            handles = [self._goals[name] for name in goals if name in self._goals]
        for handle in handles:
            handle.cancel_goal_async()

    def _on_feedback(self, name: str, _: Any) -> None:
        self._heard[name] = self._now()

    def _is_silent(self, name: str, goal: Any, ends_s: float) -> bool:
        """Tell whether a controller that follows a goal neither tells how far it is nor moves, with some way to go.

        Its messages alone do not tell: a busy machine hands them over late, and a joint may have nothing to do in a
        motion of others. When the motion is over by the plan, its result may take longer.
        """
        now, timeout_s = self._now(), max(self._config.state_timeout_s, _TICK_S)
        if now - self._heard[name] <= timeout_s or now > ends_s:
            return False
        end = dict(zip(goal.trajectory.joint_names, goal.trajectory.points[-1].positions, strict=True))
        with self._lock:
            moved = max(self._moved.get(joint, -np.inf) for joint in CONTROLLERS[name])
            to_go = max(abs(self._joints.get(joint, position) - position) for joint, position in end.items())
        return now - moved > timeout_s and to_go > _ARRIVED

    def _alive(self) -> bool:
        return self._now() - self._joints_stamp < self._config.state_timeout_s

    def look(self) -> Scene:
        """Ask the detector about a picture taken from now on; see RobotInterface."""
        asked = self._now()
        deadline = asked + _LOOK_S
        request: Detect.Request | None = None
        while request is None:
            self._changed.wait(_TICK_S)
            self._changed.clear()
            if self._stop.is_set():
                raise StoppedError("stopped on request")
            if self._now() > deadline:
                raise MotionError("no picture came from the head camera, so I cannot look again")
            request = self._request_after(asked)
        if not self._detect.service_is_ready():
            raise MotionError("/uncom/detect does not answer; start the detection node")
        answered = threading.Event()
        future = self._detect.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        while not answered.wait(_TICK_S):
            if self._stop.is_set():
                raise StoppedError("stopped on request")
            if self._now() > deadline:
                raise MotionError("/uncom/detect did not answer in time")
        response = future.result()
        if not response.success:
            raise MotionError(f"looking again failed: {response.reason}")
        return scene_from_response(response)

    def _request_after(self, stamp_s: float) -> Detect.Request | None:
        with self._lock:
            rgb, depth, info = (self._images.get(name) for name in ("rgb", "depth", "info"))
        if rgb is None or depth is None or info is None or rgb.header.stamp != depth.header.stamp:
            return None
        taken = seconds_from_msg(rgb.header.stamp)
        if taken < stamp_s:
            return None
        frame, base = rgb.header.frame_id, self._config.base_frame
        try:
            matrix = self._tree.lookup(frame, base, taken)
        except TransformError:
            return None
        transform: TransformStamped = stamped_transform_to_msg(StampedTransform(taken, base, frame, matrix))
        return Detect.Request(
            image=rgb, depth=depth, camera_info=info, has_transform=True, camera_in_base=transform, phrases=["objects"]
        )


def _goals(trajectory: Trajectory) -> dict[str, Any]:
    """Return each controller's part of a motion."""
    return {
        name: goal_to_msg(trajectory, joints)
        for name, joints in CONTROLLERS.items()
        if set(joints) <= set(trajectory.joint_names)
    }
