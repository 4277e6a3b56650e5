# SPDX-License-Identifier: Apache-2.0
"""The execution node's access to the robot: joint states, controllers, camera, base."""

from __future__ import annotations

import threading
from functools import partial

from control_msgs.action import FollowJointTrajectory
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from uncom_common.conversions import stamped_transforms_from_msg
from uncom_common.exceptions import TransformError
from uncom_common.transforms import TransformBuffer
from uncom_perception.types import Scene

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.conversions import base_pose_from_matrix
from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.robot.gripper_joints import finger_gap, finger_motion
from uncom_tiago_exec.ros.base_drive import BaseDrive
from uncom_tiago_exec.ros.camera_client import CameraClient
from uncom_tiago_exec.ros.joint_state_listener import JointStateListener
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions
from uncom_tiago_exec.ros.trajectory_clients import TrajectoryClients
from uncom_tiago_exec.types import ODOM_ORIGIN, BasePose, Side, Trajectory


class RosRobot(RobotInterface):
    """A robot behind ROS topics and actions. Called from the engine's thread only, but for `halt` and `resume`."""

    def __init__(self, node: Node, config: ExecutionConfig, options: RobotConnectionOptions = ROBOT_CONNECTION) -> None:
        """Make subscriptions and clients on a node; nothing is waited for."""
        self._config = config
        group = ReentrantCallbackGroup()
        self._stop = threading.Event()
        self._tree = TransformBuffer()
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for topic, qos, static in (("/tf", 100, False), ("/tf_static", latched, True)):
            callback = partial(self._on_tf, static=static)
            node.create_subscription(TFMessage, topic, callback, qos, callback_group=group)
        timeout_s = config.state_timeout_s
        self._joints = JointStateListener(node, group, timeout_s, options)
        self._controllers = TrajectoryClients(node, group, self._joints, self._stop, timeout_s, options)
        self._base = BaseDrive(node, group, self._stop, config.base_frame, options)
        self._camera = CameraClient(node, group, config, self._tree, self._stop, options)

    def _on_tf(self, msg: TFMessage, *, static: bool) -> None:
        for transform in stamped_transforms_from_msg(msg.transforms):
            self._tree.add(transform, static=static)

    def halt(self) -> None:
        """Cancel every goal; calls in progress raise StoppedError until `resume`."""
        self._stop.set()
        self._controllers.cancel_all()
        self._camera.wake()

    def resume(self) -> None:
        """Allow motion again after a halt."""
        self._stop.clear()

    def positions(self) -> dict[str, float]:
        """Return joint positions; see RobotInterface."""
        return self._joints.positions()

    def follow(self, trajectory: Trajectory) -> None:
        """Send torso and arm their parts and wait for both; see RobotInterface."""
        for name, result in self._controllers.send(trajectory).items():
            if result.error_code != FollowJointTrajectory.Result.SUCCESSFUL:
                raise MotionError(f"{name} gave up: {result.error_string or result.error_code}")

    def grip(self, side: Side, gap: float) -> float:
        """Bring the fingers to a gap; see RobotInterface."""
        self._controllers.send(finger_motion(side, gap, self.positions()))
        return finger_gap(side, self.positions())

    def look(self) -> Scene:
        """Ask the detector about a picture taken from now on; see RobotInterface."""
        return self._camera.look()

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
        self._base.drive(distance)
