# SPDX-License-Identifier: Apache-2.0
"""The ROS side of one trajectory controller: its action, its topic, its state."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory

from uncom_sim.controllers.joint_trajectory import Outcome
from uncom_sim.controllers.trajectory import ErrorCode, TrajectoryError, check
from uncom_sim.driver.ros.conversions import (
    controller_state_to_msg,
    feedback_to_msg,
    result_to_msg,
    tolerances_from_msg,
    trajectory_from_msg,
)
from uncom_sim.world.simulator import Simulator

Defer = Callable[[Callable[[], None]], None]


class TrajectoryActionServer:
    """Offers `/<controller>/follow_joint_trajectory`, `/joint_trajectory` and `/controller_state`.

    Callbacks only check and hand over; `begin`, `watch` and `report` run in the thread that steps the simulation.
    """

    def __init__(self, node: Node, simulator: Simulator, name: str, defer: Defer) -> None:
        """Advertise the controller of a name; `defer` runs a function between two physics steps."""
        self._node = node
        self._simulator = simulator
        self._controller = simulator.controllers[name]
        self._name = name
        self._defer = defer
        self._handle: ServerGoalHandle | None = None
        self._state = node.create_publisher(JointTrajectoryControllerState, f"/{name}/controller_state", 10)
        group = ReentrantCallbackGroup()
        node.create_subscription(
            JointTrajectory, f"/{name}/joint_trajectory", self._on_trajectory, 10, callback_group=group
        )
        self._server = ActionServer(
            node,
            FollowJointTrajectory,
            f"/{name}/follow_joint_trajectory",
            execute_callback=self._never_called_without_outcome,
            goal_callback=self._on_goal,
            handle_accepted_callback=self._on_accepted,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
        )

    def destroy(self) -> None:
        """Take the action away."""
        self._server.destroy()

    # --- callbacks ---

    def _on_goal(self, goal: FollowJointTrajectory.Goal) -> GoalResponse:
        try:
            check(trajectory_from_msg(goal.trajectory), self._controller.config.joints, self._simulator.time_s)
        except TrajectoryError as error:
            self._node.get_logger().warning(f"{self._name}: goal rejected: {error}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _on_accepted(self, handle: ServerGoalHandle) -> None:
        self._defer(partial(self._begin, handle))

    def _on_trajectory(self, msg: JointTrajectory) -> None:
        self._defer(partial(self._follow, msg))

    # --- between physics steps ---

    def _begin(self, handle: ServerGoalHandle) -> None:
        goal = handle.request
        end = partial(self._end, handle)
        try:
            self._controller.start(
                trajectory_from_msg(goal.trajectory), self._simulator.time_s, tolerances_from_msg(goal), end
            )
        except TrajectoryError as error:
            end(Outcome(error.code, str(error)))
            return
        self._handle = handle

    def _follow(self, msg: JointTrajectory) -> None:
        try:
            if msg.points:
                self._controller.start(trajectory_from_msg(msg), self._simulator.time_s)
            else:
                self._controller.cancel(self._actual()[0])
        except TrajectoryError as error:
            self._node.get_logger().warning(f"{self._name}: trajectory ignored: {error}")

    def watch(self) -> None:
        """Cancel the goal if its client has asked for that."""
        if self._handle is not None and self._handle.is_cancel_requested:
            self._controller.cancel(self._actual()[0])

    def report(self) -> None:
        """Publish the controller's state, and feedback to who sent the goal."""
        position, velocity = self._actual()
        joints, desired, now = self._controller.config.joints, self._controller.desired, self._simulator.time_s
        if self._handle is not None:
            self._handle.publish_feedback(feedback_to_msg(joints, desired, position, velocity, now))
        if self._state.get_subscription_count() > 0:
            self._state.publish(controller_state_to_msg(joints, desired, position, velocity, now))

    def _actual(self) -> tuple[Any, Any]:
        joints = self._controller.config.joints
        return self._simulator.joint_positions(joints), self._simulator.joint_velocities(joints)

    def _end(self, handle: ServerGoalHandle, outcome: Outcome) -> None:
        """Close a goal: the executor runs its execute callback now that the outcome is known, so nothing ever waits."""
        if self._handle is handle:
            self._handle = None
        handle.execute(partial(_result, outcome))

    @staticmethod
    def _never_called_without_outcome(handle: ServerGoalHandle) -> FollowJointTrajectory.Result:
        handle.abort()
        return FollowJointTrajectory.Result(error_code=FollowJointTrajectory.Result.INVALID_GOAL)


def _result(outcome: Outcome, handle: ServerGoalHandle) -> FollowJointTrajectory.Result:
    if outcome.cancelled and handle.is_cancel_requested:
        handle.canceled()
    elif outcome.code is ErrorCode.SUCCESSFUL and not outcome.cancelled:
        handle.succeed()
    else:
        handle.abort()
    return result_to_msg(outcome)
