# SPDX-License-Identifier: Apache-2.0
"""Node that reads hands and pointing rays from camera images and publishes /uncom/hands for every image."""

from __future__ import annotations

import sys
import threading
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger
from uncom_common.camera import PinholeCamera
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import camera_from_msg, depth_from_msg, rgb_from_msg, seconds_from_msg
from uncom_common.exceptions import UncomError

from uncom_interfaces.msg import Hands, SpeechStatus, Transcript
from uncom_perception.config import GestureConfig
from uncom_perception.conversions import hands_to_msg
from uncom_perception.frames import FrameQueue
from uncom_perception.hands.hand_bridge import HandBridge
from uncom_perception.hands.make_gesture_reader import make_gesture_reader
from uncom_perception.hands.pointing_attention import expected_after_speech, expected_after_words

#: Words with which people point; while they are heard, a hand is looked for more closely.

_CAMERA = "/head_front_camera"


class GestureNode(ConfiguredNode[GestureConfig]):
    """Callbacks only put images into a queue; one worker thread reads them in order."""

    def __init__(self, **node_options: Any) -> None:
        """Load the back end, subscribe, start the worker."""
        super().__init__("gesture_node", GestureConfig, **node_options)
        self._reader = make_gesture_reader(self.config)
        self._bridge = HandBridge(self.config.bridge_s)
        self._camera: PinholeCamera | None = None
        self._queue = FrameQueue(self.config.queue_size, self.config.depth_wait_s if self.config.use_depth else 0.0)
        self._publisher = self.create_publisher(Hands, "/uncom/hands", 50)
        reliability = ReliabilityPolicy.RELIABLE if self.config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=10, reliability=reliability)
        self.create_subscription(CameraInfo, f"{_CAMERA}/rgb/camera_info", self._on_info, qos)
        self.create_subscription(Image, f"{_CAMERA}/rgb/image_raw", self._on_image, qos)
        if self.config.use_depth:
            self.create_subscription(Image, f"{_CAMERA}/depth_registered/image_raw", self._on_depth, qos)
        self.create_subscription(SpeechStatus, "/uncom/speech_status", self._on_speech, 10)
        self.create_subscription(Transcript, "/uncom/transcript", self._on_words, 10)
        self._came = self._examined = 0
        self._told_s = float("-inf")  # stamp of the newest hands published
        self._depth_s = float("-inf")  # stamp of the newest depth that came
        self.create_service(Trigger, "~/settle", self._on_settle)
        self._worker = threading.Thread(target=self._work, name="gesture", daemon=True)
        self._worker.start()
        self.get_logger().info(f"hands by {self._reader.name}; pointing styles {', '.join(self.config.styles)}")

    def destroy_node(self) -> None:
        """Stop the worker, then the node."""
        self._queue.close()
        self._worker.join(timeout=5.0)
        super().destroy_node()

    def _on_info(self, msg: CameraInfo) -> None:
        self._camera = camera_from_msg(msg)

    def _on_speech(self, msg: SpeechStatus) -> None:
        if msg.state == SpeechStatus.SPEECH:
            self._expect(expected_after_speech(seconds_from_msg(msg.header.stamp), self.config.attention_s))

    def _on_words(self, msg: Transcript) -> None:
        words = (word.text for word in msg.words)
        self._expect(expected_after_words(words, seconds_from_msg(msg.header.stamp), self.config.attention_s))

    def _expect(self, until_s: float) -> None:
        if until_s > float("-inf"):
            self._reader.expect(until_s)

    def _on_settle(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Tell whether all images that came were examined.

        The message is the stamps [s] of the newest hands told and of the newest depth that came, and how many images
        were examined.

        Whoever plays a bag holds it for that, so that no image is dropped.
        """
        response.success = self._examined + self._queue.dropped >= self._came
        response.message = f"{self._told_s!r} {self._depth_s!r} {self._examined}"
        return response

    def _on_image(self, msg: Image) -> None:
        self._came += 1
        self._queue.add_image(_key(msg), msg)

    def _on_depth(self, msg: Image) -> None:
        self._queue.add_depth(_key(msg), msg)
        self._depth_s = seconds_from_msg(msg.header.stamp)

    def _work(self) -> None:
        stamps: dict[float, Any] = {}
        while (frame := self._queue.take()) is not None:
            image, depth = frame
            try:
                hands = self._reader.read(
                    rgb_from_msg(image),
                    seconds_from_msg(image.header.stamp),
                    image.header.frame_id,
                    depth_from_msg(depth) if depth is not None else None,
                    self._camera,
                )
            except UncomError as error:
                self.get_logger().error(str(error), throttle_duration_sec=5.0)
                self._examined += 1
                continue
            stamps[hands.stamp_s] = image.header.stamp  # exactly, not through a float
            for ready in self._bridge.add(hands):
                msg = hands_to_msg(ready)
                msg.header.stamp = stamps.pop(ready.stamp_s, image.header.stamp)
                self._publisher.publish(msg)
                self._told_s = ready.stamp_s
            self._examined += 1


def _key(msg: Image) -> int:
    return int(msg.header.stamp.sec) * 1_000_000_000 + int(msg.header.stamp.nanosec)


def main(args: list[str] | None = None) -> None:
    """Run the node."""

    def make() -> Node:
        return GestureNode()

    # It examines as many images as it can; sound cannot be left out, images can.
    sys.exit(run_node(make, args, niceness=5))


if __name__ == "__main__":
    main()
