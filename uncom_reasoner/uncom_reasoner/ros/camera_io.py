# SPDX-License-Identifier: Apache-2.0
"""The reasoner's eyes: the camera's topics into its memory, and questions to the detector."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from uncom_common.conversions import (
    camera_from_msg,
    seconds_from_msg,
    stamped_transform_to_msg,
    stamped_transforms_from_msg,
)
from uncom_common.transforms import StampedTransform
from uncom_perception.conversions import hands_from_msg

from uncom_interfaces.msg import Hands
from uncom_interfaces.srv import Detect
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.evidence.sensor_memory import SeenHands, Senses

CAMERA = "/head_front_camera"


class Looking:
    """Subscriptions that fill the senses, and the client of /uncom/detect; nothing here waits."""

    def __init__(self, node: Node, config: ReasonerConfig, senses: Senses, group: CallbackGroup) -> None:
        """Connect."""
        self._config, self._senses = config, senses
        self.image_s = self.depth_s = float("-inf")  # stamps of the newest that came [s]
        reliability = ReliabilityPolicy.RELIABLE if config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        images = QoSProfile(depth=10, reliability=reliability)
        fixed = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        subscribe = partial(node.create_subscription, callback_group=group)
        subscribe(Image, f"{CAMERA}/rgb/image_raw", self._on_image, images)
        subscribe(CameraInfo, f"{CAMERA}/rgb/camera_info", self._on_camera_info, images)
        if config.use_depth:
            subscribe(Image, f"{CAMERA}/depth_registered/image_raw", self._on_depth, images)
        subscribe(Hands, "/uncom/hands", self._on_hands, 50)
        subscribe(TFMessage, "/tf", partial(self._on_tf, static=False), QoSProfile(depth=100))
        subscribe(TFMessage, "/tf_static", partial(self._on_tf, static=True), fixed)
        self._detect = node.create_client(Detect, "/uncom/detect", callback_group=group)

    def _on_image(self, msg: Image) -> None:
        self._senses.camera_frame = msg.header.frame_id
        self.image_s = seconds_from_msg(msg.header.stamp)
        self._senses.images.add(self.image_s, msg)

    def _on_depth(self, msg: Image) -> None:
        self.depth_s = seconds_from_msg(msg.header.stamp)
        self._senses.depths.add(self.depth_s, msg)

    def _on_camera_info(self, msg: CameraInfo) -> None:
        if self._senses.camera_info is None or list(self._senses.camera_info.k) != list(msg.k):
            self._senses.camera = camera_from_msg(msg)
            self._senses.camera_info = msg

    def _on_hands(self, msg: Hands) -> None:
        self._senses.hands.add(seconds_from_msg(msg.header.stamp), SeenHands(hands_from_msg(msg), msg))

    def _on_tf(self, msg: TFMessage, *, static: bool) -> None:
        for transform in stamped_transforms_from_msg(msg.transforms):
            self._senses.transforms.add(transform, static=static)

    def ready(self) -> bool:
        """Whether the detector is there."""
        return bool(self._detect.service_is_ready())

    def detect(self, stamp_s: float, phrases: Sequence[str], done: Callable[[Any], None], *, with_hand: bool) -> bool:
        """Ask for the things in the image of a time; `done` gets the future. False if the image is gone."""
        image = self._senses.image_at(stamp_s)
        if image is None or self._senses.camera_info is None:
            return False
        request = Detect.Request(image=image, camera_info=self._senses.camera_info, phrases=list(phrases))
        depth = self._senses.depth_at(stamp_s)
        if depth is not None:
            request.depth = depth
        transform = self._senses.camera_in_base(stamp_s)
        if transform is not None:
            request.has_transform = True
            stamped = StampedTransform(stamp_s, self._config.base_frame, image.header.frame_id, transform)
            request.camera_in_base = stamped_transform_to_msg(stamped)
        hands = self._senses.hands_at(stamp_s)
        if with_hand and hands is not None:
            request.hands = hands
        self._detect.call_async(request).add_done_callback(done)
        return True
