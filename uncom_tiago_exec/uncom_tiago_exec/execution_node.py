# SPDX-License-Identifier: Apache-2.0
"""The node that turns grounded commands into motion.

Subscribes /uncom/grounded_command, /uncom/answer (approval), /uncom/stop, /robot_description and what RosRobot needs;
publishes /uncom/execution_status; serves /uncom/execute and /uncom/reset. One command is carried out at a time, in
a worker thread; callbacks only store and wake it.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
from dataclasses import dataclass
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import header_to_msg, seconds_from_msg
from uncom_common.exceptions import UncomError

from uncom_interfaces.action import Execute
from uncom_interfaces.msg import Answer, ExecutionStatus, GroundedCommand
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.conversions import status_to_msg, task_from_msg
from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.ros.ros_robot import RosRobot
from uncom_tiago_exec.scene.base_frame import task_in_odom
from uncom_tiago_exec.types import ManipulationTask, Outcome, Stage, Status

STOPPED_TEXT = "I was stopped; /uncom/reset lets me move again"


@dataclass(slots=True)
class _Job:
    """One command on its way through the worker; `goal` is the action goal it came from, if any."""

    command: GroundedCommand
    goal: Any = None


class ExecutionNode(ConfiguredNode[ExecutionConfig]):
    """Takes commands one at a time to the engine, in a worker thread, and publishes what becomes of them."""

    def __init__(self, **node_options: Any) -> None:
        """Make topics and start the worker; nothing is waited for."""
        super().__init__("execution_node", ExecutionConfig, **node_options)
        self._robot = RosRobot(self, self.config)
        self._model: RobotModel | None = None
        self._engine: Engine | None = None
        self._jobs: queue.Queue[_Job | None] = queue.Queue()
        self._current: _Job | None = None
        self._lock = threading.Lock()
        self._stopped = False  # by /uncom/stop; until /uncom/reset nothing is carried out
        self._answer = threading.Event()
        self._approved = False
        self._question_id = ""
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        latest = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        group = ReentrantCallbackGroup()
        self._status_pub = self.create_publisher(ExecutionStatus, "/uncom/execution_status", latched)
        self.create_subscription(String, "/robot_description", self._on_description, latest, callback_group=group)
        self.create_subscription(GroundedCommand, "/uncom/grounded_command", self._on_command, 10, callback_group=group)
        self.create_subscription(Answer, "/uncom/answer", self._on_answer, 10, callback_group=group)
        self.create_subscription(Empty, "/uncom/stop", self._on_stop, 10, callback_group=group)
        self.create_service(Trigger, "/uncom/reset", self._on_reset, callback_group=group)
        self._server = ActionServer(
            self,
            Execute,
            "/uncom/execute",
            lambda _: Execute.Result(),
            goal_callback=self._on_goal,
            handle_accepted_callback=self._on_accepted,
            cancel_callback=self._on_cancel,
            callback_group=group,
        )
        self._publish(None, Status(Stage.IDLE, "ready"))
        self._worker = threading.Thread(target=self._run_worker, name="execution", daemon=True)
        self._worker.start()

    def destroy_node(self) -> None:
        """Stop what moves and end the worker."""
        self._robot.halt()
        self._answer.set()
        self._jobs.put(None)
        self._worker.join(timeout=2.0)
        self._server.destroy()
        super().destroy_node()

    # What ROS calls only stores and wakes.

    def _on_description(self, msg: String) -> None:
        try:
            self._model = RobotModel(msg.data)
        except UncomError as error:
            self.get_logger().error(str(error))

    def _on_command(self, msg: GroundedCommand) -> None:
        if msg.status != GroundedCommand.GROUNDED:
            return
        self._enqueue(_Job(msg))

    def _enqueue(self, job: _Job) -> None:
        with self._lock:
            busy = self._current is not None
        if busy and self.config.preempt:
            self._robot.halt()
            self._answer.set()
        elif busy:
            self.get_logger().info("a command waits until the present one is done")
        self._jobs.put(job)

    def _on_answer(self, msg: Answer) -> None:
        if not self._question_id or msg.question_id != self._question_id:
            return
        if msg.answer in (Answer.YES, Answer.NO):
            self._approved = msg.answer == Answer.YES
            self._answer.set()

    def _on_stop(self, _: Empty) -> None:
        with self._lock:
            self._stopped = True
            running = self._current is not None
        self.get_logger().warning("stop requested; /uncom/reset allows motion again")
        self._robot.halt()
        self._approved = False
        self._answer.set()
        if not running:
            self._publish(None, Status(Stage.STOPPED, STOPPED_TEXT))

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self._lock:
            was, self._stopped = self._stopped, False
            running = self._current is not None
        response.success = True
        response.message = "ready" if was else "was not stopped"
        if was and not running:
            self._publish(None, Status(Stage.IDLE, "ready"))
        return response

    def _on_goal(self, _: Execute.Goal) -> GoalResponse:
        with self._lock:
            busy, stopped = self._current is not None, self._stopped
        refused = stopped or (busy and not self.config.preempt)
        return GoalResponse.REJECT if refused else GoalResponse.ACCEPT

    def _on_cancel(self, _: Any) -> CancelResponse:
        self._robot.halt()
        self._answer.set()
        return CancelResponse.ACCEPT

    def _on_accepted(self, goal: Any) -> None:
        """Hand the goal to the worker; its result is given from there, so that no executor thread waits."""
        self._enqueue(_Job(goal.request.command, goal))

    def _give_result(self, goal: Any, outcome: Outcome) -> Execute.Result:
        if goal.is_cancel_requested:
            goal.canceled()
        elif outcome.success:
            goal.succeed()
        else:
            goal.abort()
        return Execute.Result(
            success=outcome.success,
            stage=int(outcome.stage),
            reason=outcome.reason,
            in_hand=outcome.in_hand,
            verification_json=json.dumps(outcome.verification),
        )

    # What the worker thread runs.

    def _run_worker(self) -> None:
        while (job := self._jobs.get()) is not None:
            with self._lock:
                self._current = job
                stopped = self._stopped
                if not stopped:
                    self._robot.resume()
            outcome = self._refuse(job, Stage.FAILED, STOPPED_TEXT) if stopped else self._execute(job)
            with self._lock:
                self._current = None
                stopped = self._stopped
            goal = job.goal
            if goal is not None and self.context.ok():
                goal.execute(lambda handle, result=outcome: self._give_result(handle, result))
            if self._jobs.empty() and self.context.ok():
                self._publish(job, Status(Stage.STOPPED, STOPPED_TEXT) if stopped else Status(Stage.IDLE, "ready"))

    def _execute(self, job: _Job) -> Outcome:
        try:
            task = self._task_in_odom(job.command)
            engine = self._engine_for(self._robot_model())
            if self.config.require_approval:
                self._await_approval(job, task)
        except UncomError as error:
            return self._refuse(job, Stage.FAILED, str(error))
        try:
            return engine.execute(task)
        except Exception as error:  # noqa: BLE001 - the worker must outlive any fault of one command
            self.get_logger().error(f"internal fault: {type(error).__name__}: {error}")
            self._robot.halt()
            return self._refuse(job, Stage.FAILED, f"internal fault while executing ({type(error).__name__})")

    def _task_in_odom(self, command: GroundedCommand) -> ManipulationTask:
        """Return a command as a task in odom, from where the base stood when its header was stamped."""
        task = task_from_msg(command)
        if command.header.frame_id == self.config.odom_frame:
            return task
        return task_in_odom(task, self._robot.base_pose(seconds_from_msg(command.header.stamp)))

    def _refuse(self, job: _Job, stage: Stage, text: str) -> Outcome:
        self._publish(job, Status(stage, text))
        return Outcome(False, stage, text)

    def _engine_for(self, model: RobotModel) -> Engine:
        """Return the engine; it outlives a command, for it knows what is in the hand and where home is."""
        if self._engine is None or self._engine.model is not model:
            self._engine = Engine(model, self._robot, self.config, lambda status: self._publish(self._current, status))
        return self._engine

    def _robot_model(self) -> RobotModel:
        if self._model is None:
            raise RefusedError("/robot_description has not arrived; is the robot running?")
        return self._model

    def _await_approval(self, job: _Job, task: ManipulationTask) -> None:
        """Say that approval is awaited and wait for the answer on this thread; the reasoner puts the question.

        Raises:
            RefusedError: the answer is no, or none came in time.
        """
        command = job.command
        action = f"{command.action_text or task.primitive.value} the {task.object_text or 'object'}"
        place = f" ({task.relation.replace('_', ' ')} {task.target_text})" if task.target_text else ""
        self._answer.clear()
        self._approved = False
        self._question_id = f"approve-{command.utterance_id}-{command.index}"
        self._publish(job, Status(Stage.AWAITING_APPROVAL, f"may I {action}{place}?"))
        answered = self._answer.wait(self.config.approval_timeout_s)
        self._question_id = ""
        if not answered:
            raise RefusedError("nobody approved the motion in time")
        if not self._approved:
            raise RefusedError("the motion was not approved")

    def _publish(self, job: _Job | None, status: Status) -> None:
        if not self.context.ok():
            return
        stamp = float(self.get_clock().now().nanoseconds) * 1e-9
        header = header_to_msg(stamp, self.config.base_frame)
        utterance, index = (job.command.utterance_id, int(job.command.index)) if job else ("", 0)
        msg = status_to_msg(status, header, utterance, index)
        self._status_pub.publish(msg)
        if status.detail:
            self.get_logger().info(f"{status.stage.name.lower()}: {status.detail}")
        if job is not None and job.goal is not None and job.goal.is_active:
            job.goal.publish_feedback(Execute.Feedback(status=msg))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(ExecutionNode, args))


if __name__ == "__main__":
    main()
