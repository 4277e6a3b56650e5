# SPDX-License-Identifier: Apache-2.0
"""The camera's topics, hands and transforms into the session's memory, and the client of the detector."""

from __future__ import annotations

from collections.abc import Callable
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
from uncom_perception.conversions import hands_from_msg, hands_to_msg, scene_from_response

from uncom_interfaces.msg import Hands
from uncom_interfaces.srv import Detect
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.session.events import Events
from uncom_reasoner.session.session import Session
from uncom_reasoner.session.task import DetectionRequest

_CAMERA = "/head_front_camera"


class CameraIo:
    """Subscriptions that fill the memory, and the client of /uncom/detect; nothing here waits."""

    def __init__(
        self,
        node: Node,
        config: ReasonerConfig,
        session: Session,
        group: CallbackGroup,
        publish: Callable[[Events], None],
    ) -> None:
        """Create the subscriptions and the client.

        Args:
            node: that receives.
            config: of the node.
            session: whose memory is filled and whose requests are passed on.
            group: of the callbacks.
            publish: publishes what the session makes of an answer.
        """
        self._session, self._memory, self._publish = session, session.memory, publish
        self._camera_info: CameraInfo | None = None
        self.image_s = self.depth_s = float("-inf")  # stamps of the newest that came [s]
        reliability = ReliabilityPolicy.RELIABLE if config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        images = QoSProfile(depth=10, reliability=reliability)
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        subscribe = partial(node.create_subscription, callback_group=group)
        subscribe(Image, f"{_CAMERA}/rgb/image_raw", self._on_image, images)
        subscribe(CameraInfo, f"{_CAMERA}/rgb/camera_info", self._on_camera_info, images)
        if config.use_depth:
            subscribe(Image, f"{_CAMERA}/depth_registered/image_raw", self._on_depth, images)
        subscribe(Hands, "/uncom/hands", self._on_hands, 50)
        subscribe(TFMessage, "/tf", partial(self._on_tf, static=False), QoSProfile(depth=100))
        subscribe(TFMessage, "/tf_static", partial(self._on_tf, static=True), latched)
        self._client = node.create_client(Detect, "/uncom/detect", callback_group=group)

    def _on_image(self, msg: Image) -> None:
        self._memory.camera_frame = msg.header.frame_id
        self.image_s = seconds_from_msg(msg.header.stamp)
        self._memory.images.add(self.image_s, msg)

    def _on_depth(self, msg: Image) -> None:
        self.depth_s = seconds_from_msg(msg.header.stamp)
        self._memory.depths.add(self.depth_s, msg)

    def _on_camera_info(self, msg: CameraInfo) -> None:
        if self._camera_info is None or list(self._camera_info.k) != list(msg.k):
            self._camera_info = msg
            self._memory.camera = camera_from_msg(msg)

    def _on_hands(self, msg: Hands) -> None:
        self._memory.hands.add(seconds_from_msg(msg.header.stamp), hands_from_msg(msg))

    def _on_tf(self, msg: TFMessage, *, static: bool) -> None:
        for transform in stamped_transforms_from_msg(msg.transforms):
            self._memory.transforms.add(transform, static=static)

    def detector_ready(self) -> bool:
        """Whether the detection node is there."""
        return bool(self._client.service_is_ready())

    def detect(self, request: DetectionRequest) -> None:
        """Ask the detection node; the session is given the answer when it comes."""
        stamp_s = request.frame.stamp_s
        image = self._memory.image_at(stamp_s)
        if image is None or self._camera_info is None:
            self._publish(self._session.take_failure(request, "the image is gone"))
            return
        message = Detect.Request(image=image, camera_info=self._camera_info, phrases=list(request.phrases))
        depth = self._memory.depth_at(stamp_s)
        if depth is not None:
            message.depth = depth
        transform = self._memory.camera_in_base(stamp_s)
        if transform is not None:
            message.has_transform = True
            stamped = StampedTransform(stamp_s, self._memory.base_frame, image.header.frame_id, transform)
            message.camera_in_base = stamped_transform_to_msg(stamped)
        hands = self._memory.hands_at(stamp_s)
        if request.frame.with_hand and hands is not None:
            message.hands = hands_to_msg(hands)
        self._client.call_async(message).add_done_callback(partial(self._on_answer, request))

    def _on_answer(self, request: DetectionRequest, future: Any) -> None:
        response = future.result() if future.exception() is None else None
        if response is None:
            self._publish(self._session.take_failure(request, "no answer"))
        elif not response.success:
            self._publish(self._session.take_failure(request, response.reason))
        else:
            self._session.take_scene(request, scene_from_response(response))
