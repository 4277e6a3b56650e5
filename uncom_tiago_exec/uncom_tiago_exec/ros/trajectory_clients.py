# SPDX-License-Identifier: Apache-2.0
"""The robot's joint trajectory controllers: motions are sent to those they concern, and waited for."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from functools import partial
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from uncom_common.conversions import seconds_from_msg

from uncom_tiago_exec.conversions import goal_to_msg
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.robot.joint_names import HEAD_JOINTS, TORSO_JOINT, arm_joints, finger_joints
from uncom_tiago_exec.ros.debounce import Debounce
from uncom_tiago_exec.ros.joint_state_listener import JointStateListener
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions
from uncom_tiago_exec.ros.race_free_action_client import RaceFreeActionClient
from uncom_tiago_exec.types import SIDES, Trajectory

CONTROLLERS: dict[str, tuple[str, ...]] = {
    "torso_controller": (TORSO_JOINT,),
    "head_controller": HEAD_JOINTS,
    **{f"arm_{side}_controller": arm_joints(side) for side in SIDES},
    **{f"gripper_{side}_controller": finger_joints(side) for side in SIDES},
}


class TrajectoryClients:
    """Sends one motion at a time. Everything but callbacks and `cancel_all` is called from one thread only."""

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        joints: JointStateListener,
        stop: threading.Event,
        timeout_s: float,
        options: RobotConnectionOptions = ROBOT_CONNECTION,
    ) -> None:
        """Make clients on a node; nothing is waited for.

        Args:
            node: whose clock counts.
            group: in which answers are handled.
            joints: tell whether a controller moves.
            stop: set once motion is to end.
            timeout_s: silence of a controller, on the node's clock, after which it counts as dead [s].
            options: of the connection.
        """
        self._node = node
        self._joints = joints
        self._stop = stop
        self._timeout_s = max(timeout_s, options.poll_s)
        self._options = options
        self._lock = threading.Lock()
        self._handles: dict[str, Any] = {}
        self._heard_s: dict[str, float] = {}  # when each controller last told how far it is
        self.clients = {
            name: RaceFreeActionClient(
                node, FollowJointTrajectory, f"/{name}/follow_joint_trajectory", callback_group=group
            )
            for name in CONTROLLERS
        }

    def cancel_all(self) -> None:
        """Cancel every goal that is under way."""
        with self._lock:
            handles = list(self._handles.values())
        for handle in handles:
            handle.cancel_goal_async()

    def send(self, trajectory: Trajectory) -> Mapping[str, Any]:
        """Send a motion to the controllers it concerns and return their results once all have come.

        All are cancelled on a stop, where one falls silent, and where one fails.

        Raises:
            MotionError: a controller is not there, fell silent, or did not finish in time.
            StoppedError: it was stopped on request.
        """
        goals = _goals(trajectory)
        if self._stop.is_set():
            raise StoppedError("stopped")
        results: dict[str, Any] = {}
        done = threading.Event()
        ends_s = self._now_s() + self._start(goals, results, done)
        silent = self._wait(goals, results, done, ends_s)
        with self._lock:
            for name in goals:
                self._handles.pop(name, None)
        if self._stop.is_set():
            raise StoppedError("stopped on request")
        if not done.is_set() and not any(result.error_code for result in results.values()):
            self._joints.positions()  # says so if joint states fell silent
            if silent:
                raise MotionError(f"{', '.join(silent)} fell silent; are the robot's controllers running?")
            raise MotionError(f"{', '.join(goals)} did not finish in time")
        return results

    def _start(self, goals: Mapping[str, Any], results: dict[str, Any], done: threading.Event) -> float:
        """Send goals, and return how long the longest takes by the plan [s]."""
        duration_s = 0.0
        for name, goal in goals.items():
            if not self.clients[name].server_is_ready():
                raise MotionError(f"{name} is not running; start the robot's controllers")
            duration_s = max(duration_s, seconds_from_msg(goal.trajectory.points[-1].time_from_start))
            self._heard_s[name] = self._now_s() + self._options.acceptance_s
            future = self.clients[name].send_goal_async(goal, feedback_callback=partial(self._on_feedback, name))
            future.add_done_callback(lambda f, n=name: self._on_answer(n, f, results, done, len(goals)))
        return duration_s

    def _wait(
        self, goals: Mapping[str, Any], results: Mapping[str, Any], done: threading.Event, ends_s: float
    ) -> list[str]:
        """Wait for all results, or cancel; return the names of the controllers that are silent."""
        deadline_s = ends_s + self._options.overtime_s
        silence, silent = Debounce(self._options.silence_s), list[str]()
        while not done.wait(self._options.poll_s):
            failed = [r for r in results.values() if r.error_code != FollowJointTrajectory.Result.SUCCESSFUL]
            silent = [n for n, goal in goals.items() if n not in results and self._is_silent(n, goal, ends_s)]
            lost = silence.holds(bool(silent) or not self._joints.is_alive)
            if self._stop.is_set() or self._now_s() > deadline_s or failed or lost:
                self._cancel(goals)
                break
        return silent

    def _on_answer(self, name: str, future: Any, results: dict[str, Any], done: threading.Event, count: int) -> None:
        handle = future.result()
        if not handle.accepted:
            refused = FollowJointTrajectory.Result(error_code=FollowJointTrajectory.Result.INVALID_GOAL)
            refused.error_string = "the goal was refused"
            self._finish(name, refused, results, done, count)
            return
        with self._lock:
            self._handles[name] = handle
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

    def _cancel(self, goals: Mapping[str, Any]) -> None:
        with self._lock:
            handles = [self._handles[name] for name in goals if name in self._handles]
        for handle in handles:
            handle.cancel_goal_async()

    def _on_feedback(self, name: str, _: Any) -> None:
        self._heard_s[name] = self._now_s()

    def _is_silent(self, name: str, goal: Any, ends_s: float) -> bool:
        """Tell whether a controller that follows a goal neither tells how far it is nor moves, with some way to go.

        Its messages alone do not tell: a busy machine hands them over late, and a joint may have nothing to do in a
        motion of others. When the motion is over by the plan, its result may take longer.
        """
        now_s = self._now_s()
        if now_s - self._heard_s[name] <= self._timeout_s or now_s > ends_s:
            return False
        end = dict(zip(goal.trajectory.joint_names, goal.trajectory.points[-1].positions, strict=True))
        rests = now_s - self._joints.last_motion_s(CONTROLLERS[name]) > self._timeout_s
        return rests and self._joints.distance_to(end) > self._options.arrival

    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9


def _goals(trajectory: Trajectory) -> dict[str, Any]:
    """Return each controller's part of a motion."""
    return {
        name: goal_to_msg(trajectory, joints)
        for name, joints in CONTROLLERS.items()
        if set(joints) <= set(trajectory.joint_names)
    }
