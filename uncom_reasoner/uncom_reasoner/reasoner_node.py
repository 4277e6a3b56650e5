# SPDX-License-Identifier: Apache-2.0
"""The reasoner's plumbing: commands, hands, images and transforms in; grounded commands, reasons and pictures out."""

from __future__ import annotations

import sys
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Empty, String
from tf2_msgs.msg import TFMessage
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import (
    camera_from_msg,
    header_to_msg,
    rgb_from_msg,
    rgb_to_msg,
    seconds_from_msg,
    stamped_transform_from_msg,
    stamped_transform_to_msg,
)
from uncom_common.exceptions import UncomError
from uncom_common.transforms import StampedTransform
from uncom_language.conversions import command_from_msg
from uncom_language.types import Act, Command
from uncom_perception.conversions import hands_from_msg, scene_from_response

from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.msg import Explanation, GroundedCommand, Hands
from uncom_interfaces.srv import Detect
from uncom_reasoner.annotate import annotate
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.conversions import explanation_to_msg, grounded_command_to_msg
from uncom_reasoner.decisions import failed
from uncom_reasoner.exceptions import NotSupportedError
from uncom_reasoner.explanation import explain
from uncom_reasoner.grounding import ground
from uncom_reasoner.job import Job, Stage, hands_complete, object_end, target_end
from uncom_reasoner.memory import Memory, remember
from uncom_reasoner.phrases import phrases_of
from uncom_reasoner.senses import SeenHands, Senses
from uncom_reasoner.types import Decision, Evidence, View
from uncom_reasoner.weights import load_weights
from uncom_reasoner.wording import refusal, sentence

TICK_S = 0.03


class ReasonerNode(ConfiguredNode[ReasonerConfig]):
    """Grounds every /uncom/command: one at a time, in order, each with time-outs, whatever becomes of the others."""

    def __init__(self, **node_options: Any) -> None:
        """Connect; nothing waits here."""
        super().__init__("reasoner_node", ReasonerConfig, **node_options)
        config = self.config
        self._weights = load_weights(config.weights_file)
        self._placing = config.placing()
        self._memory = Memory()
        self._senses = Senses(config)
        self._jobs: deque[Job] = deque()
        self._lock = threading.Lock()
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="deciding")
        self._connect()
        self.get_logger().info("reasoner ready: posterior over detections, Voronoi places")

    def _connect(self) -> None:
        senses = ReentrantCallbackGroup()
        reliability = ReliabilityPolicy.RELIABLE if self.config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        images = QoSProfile(depth=10, reliability=reliability)
        fixed = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        camera = "/head_front_camera"
        subscribe = partial(self.create_subscription, callback_group=senses)
        subscribe(Image, f"{camera}/rgb/image_raw", self._on_image, images)
        subscribe(CameraInfo, f"{camera}/rgb/camera_info", self._on_camera_info, images)
        if self.config.use_depth:
            subscribe(Image, f"{camera}/depth_registered/image_raw", self._on_depth, images)
        subscribe(Hands, "/uncom/hands", self._on_hands, 50)
        subscribe(TFMessage, "/tf", partial(self._on_tf, static=False), QoSProfile(depth=100))
        subscribe(TFMessage, "/tf_static", partial(self._on_tf, static=True), fixed)
        self.create_subscription(CommandMsg, "/uncom/command", self._on_command, 10)
        self._grounded = self.create_publisher(GroundedCommand, "/uncom/grounded_command", 10)
        self._explanation = self.create_publisher(Explanation, "/uncom/explanation", 10)
        self._annotated = self.create_publisher(Image, "/uncom/annotated", 10)
        self._say = self.create_publisher(String, "/uncom/say", 10)
        self._stop = self.create_publisher(Empty, "/uncom/stop", 10)
        self._detect = self.create_client(Detect, "/uncom/detect", callback_group=senses)
        own = MutuallyExclusiveCallbackGroup()
        self.create_timer(TICK_S, self._tick, callback_group=own, clock=self._steady)

    def destroy_node(self) -> None:
        """Let the decision in progress end, then go."""
        self._worker.shutdown(wait=True, cancel_futures=True)
        super().destroy_node()

    # --- what comes in ------------------------------------------------------------------------------

    def _on_image(self, msg: Image) -> None:
        self._senses.camera_frame = msg.header.frame_id
        self._senses.images.add(seconds_from_msg(msg.header.stamp), msg)

    def _on_depth(self, msg: Image) -> None:
        self._senses.depths.add(seconds_from_msg(msg.header.stamp), msg)

    def _on_camera_info(self, msg: CameraInfo) -> None:
        if self._senses.camera_info is None or list(self._senses.camera_info.k) != list(msg.k):
            self._senses.camera = camera_from_msg(msg)
            self._senses.camera_info = msg

    def _on_hands(self, msg: Hands) -> None:
        self._senses.hands.add(seconds_from_msg(msg.header.stamp), SeenHands(hands_from_msg(msg), msg))

    def _on_tf(self, msg: TFMessage, *, static: bool) -> None:
        for transform in msg.transforms:
            self._senses.transforms.add(stamped_transform_from_msg(transform), static=static)

    def _on_command(self, msg: CommandMsg) -> None:
        try:
            command = command_from_msg(msg)
        except UncomError as error:
            self.get_logger().error(str(error))
            return
        if command.act in (Act.STOP, Act.CANCEL):
            with self._lock:
                self._jobs.clear()
            self._stop.publish(Empty())
        elif command.act is Act.COMMAND:
            with self._lock:
                self._jobs.append(Job(command, self._now_s(), time.monotonic()))
        elif command.act in (Act.REFUSED, Act.INCOMPLETE):
            self._refuse(command, refusal(command), time.monotonic())

    def _now_s(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    # --- one command after the other -----------------------------------------------------------------

    def _tick(self) -> None:
        with self._lock:
            job = self._jobs[0] if self._jobs else None
        if job is None:
            return
        wall = time.monotonic()
        if job.stage is Stage.WAITING:
            limit = self.config.wait_timeout_s
            if hands_complete(job, self._senses.latest_s(), self._now_s(), wall, self.config.late_pointing_s, limit):
                self._look(job, wall)
        elif job.stage is Stage.DETECTING and wall - job.asked_wall_s > self.config.detect_timeout_s:
            self._give_up(job, "I cannot look at the table: the object detector does not answer.")

    def _look(self, job: Job, wall: float) -> None:
        """Ask the detector for the things of the frame that shows them best; wait (by the timer) until it is there."""
        choice = self._senses.scene_frame(job.command)
        image = self._senses.image_at(choice.stamp_s) if choice is not None else None
        if choice is None or image is None or self._senses.camera_info is None:
            self._give_up(job, "I see nothing: no camera images arrive.")
            return
        if not self._detect.service_is_ready():
            if wall - job.received_wall_s > self.config.detect_timeout_s:
                self._give_up(job, "I cannot look at the table: the object detector is not running.")
            return
        job.scene_s, job.with_hand = choice.stamp_s, choice.with_hand
        job.stage, job.asked_wall_s = Stage.DETECTING, wall
        future = self._detect.call_async(self._request(job, image))
        future.add_done_callback(lambda done: self._on_scene(job, done))

    def _request(self, job: Job, image: Image) -> Detect.Request:
        job.phrases = phrases_of(job.command, self._memory.noun)
        request = Detect.Request(image=image, camera_info=self._senses.camera_info, phrases=list(job.phrases))
        depth = self._senses.depth_at(job.scene_s)
        if depth is not None:
            request.depth = depth
        transform = self._senses.camera_in_base(job.scene_s)
        if transform is not None:
            request.has_transform = True
            stamped = StampedTransform(job.scene_s, self.config.base_frame, image.header.frame_id, transform)
            request.camera_in_base = stamped_transform_to_msg(stamped)
        hands = self._senses.hands_at(job.scene_s)
        if job.with_hand and hands is not None:
            request.hands = hands
        return request

    def _on_scene(self, job: Job, done: Any) -> None:
        """Hand the detector's answer to the worker, unless it comes too late."""
        with self._lock:
            if not self._jobs or self._jobs[0] is not job or job.stage is not Stage.DETECTING:
                return
            job.stage = Stage.DECIDING
        self._worker.submit(self._decide, job, done)

    def _decide(self, job: Job, done: Any) -> None:
        try:
            response = done.result()
            if response is None or not response.success:
                why = response.reason if response is not None else "no answer"
                self._give_up(job, f"I cannot look at the table: {why}")
                return
            self._ground(job, response)
        except NotSupportedError as error:
            self._give_up(job, str(error))
        except Exception as error:  # noqa: BLE001 (whatever goes wrong with one command, the next one must work)
            self.get_logger().error(f"deciding on {job.command.text!r} failed: {error!r}")
            self._give_up(job, "Something went wrong while I thought about it. Please say it again.")

    def _ground(self, job: Job, response: Any) -> None:
        command, scene = job.command, scene_from_response(response)
        in_base = scene.frame_id == self.config.base_frame
        transform = self._senses.camera_in_base(job.scene_s) if in_base else np.eye(4)
        view = View(self._senses.camera, transform)
        evidence = Evidence(
            command=command,
            scene=scene,
            phrases=job.phrases,
            view=view,
            rays=self._senses.rays(command, None if in_base else transform),
            object_frame_s=self._senses.nearest_image_s(object_end(command)),
            target_frame_s=self._senses.nearest_image_s(target_end(command)),
        )
        decision = ground(evidence, self._weights, self._placing, self._memory)
        self._memory = remember(self._memory, command, decision.grounded)
        self._finish(job, decision, view)

    # --- what goes out -------------------------------------------------------------------------------

    def _give_up(self, job: Job, reason: str) -> None:
        with self._lock:
            if self._jobs and self._jobs[0] is job:
                self._jobs.popleft()
        self._refuse(job.command, reason, job.received_wall_s)

    def _refuse(self, command: Command, reason: str, since_wall_s: float) -> None:
        grounded = replace(failed(command, reason), latency_s=time.monotonic() - since_wall_s)
        self._publish(command, Decision(grounded), 0.0)

    def _finish(self, job: Job, decision: Decision, view: View) -> None:
        with self._lock:
            if not self._jobs or self._jobs[0] is not job:
                return  # stopped meanwhile
            self._jobs.popleft()
        took = time.monotonic() - job.received_wall_s
        decision = replace(decision, grounded=replace(decision.grounded, latency_s=took))
        self._publish(job.command, decision, job.scene_s)
        self._publish_picture(decision, view)

    def _publish(self, command: Command, decision: Decision, scene_s: float) -> None:
        frame_id = decision.grounded.frame_id or self.config.base_frame
        grounded = replace(decision.grounded, stamp_s=self._now_s(), frame_id=frame_id)
        decision = replace(decision, grounded=grounded)
        self._grounded.publish(grounded_command_to_msg(grounded))
        reasons = explain(command, decision, scene_s, self._weights)
        self._explanation.publish(explanation_to_msg(reasons, header_to_msg(grounded.stamp_s, frame_id)))
        words = sentence(command, grounded)
        self._say.publish(String(data=words))
        self.get_logger().info(f"{command.text!r}: {grounded.status.name}: {words}")

    def _publish_picture(self, decision: Decision, view: View) -> None:
        g = decision.grounded
        first, second = (self._senses.image_at(stamp) for stamp in (g.object_frame_s, g.target_frame_s))
        if first is not None and second is not None:
            picture = annotate(rgb_from_msg(first), rgb_from_msg(second), decision, view)
            self._annotated.publish(rgb_to_msg(picture, first.header))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(ReasonerNode, args))


if __name__ == "__main__":
    main()
