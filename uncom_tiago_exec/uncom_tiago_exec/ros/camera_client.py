# SPDX-License-Identifier: Apache-2.0
"""The head camera and the detector behind it: a picture taken from now on, and what is in it."""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from uncom_common.conversions import seconds_from_msg, stamped_transform_to_msg
from uncom_common.exceptions import TransformError
from uncom_common.transforms import StampedTransform, TransformBuffer
from uncom_perception.conversions import scene_from_response
from uncom_perception.types import Scene

from uncom_interfaces.srv import Detect
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions

_CAMERA = "/head_front_camera"


class CameraClient:
    """Keeps the latest picture and asks /uncom/detect about it. `look` is called from one thread only."""

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        config: ExecutionConfig,
        tree: TransformBuffer,
        stop: threading.Event,
        options: RobotConnectionOptions = ROBOT_CONNECTION,
    ) -> None:
        """Subscribe on a node; nothing is waited for.

        Args:
            node: whose clock counts.
            group: in which pictures and answers are handled.
            config: of the node: its base frame, and the reliability of images.
            tree: tells where the camera is.
            stop: set once looking is to end.
            options: of the connection.
        """
        self._node = node
        self._base_frame = config.base_frame
        self._tree = tree
        self._stop = stop
        self._options = options
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._latest: dict[str, Any] = {}
        self._detect = node.create_client(Detect, "/uncom/detect", callback_group=group)
        reliability = ReliabilityPolicy.RELIABLE if config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        images = QoSProfile(depth=2, reliability=reliability)
        for name, topic, kind in (
            ("rgb", f"{_CAMERA}/rgb/image_raw", Image),
            ("depth", f"{_CAMERA}/depth_registered/image_raw", Image),
            ("info", f"{_CAMERA}/rgb/camera_info", CameraInfo),
        ):
            node.create_subscription(kind, topic, partial(self._on_message, name), images, callback_group=group)

    def _on_message(self, name: str, msg: Any) -> None:
        with self._lock:
            self._latest[name] = msg
        self._arrived.set()

    def wake(self) -> None:
        """Let a `look` that waits see that it is stopped."""
        self._arrived.set()

    def look(self) -> Scene:
        """Return what is seen in a picture taken from now on, in the base frame at that time.

        Raises:
            MotionError: no picture came, or nothing could be made of it.
            StoppedError: it was stopped on request.
        """
        asked_s = self._now_s()
        deadline_s = asked_s + self._options.look_s
        request = self._wait_for_picture(asked_s, deadline_s)
        if not self._detect.service_is_ready():
            raise MotionError("/uncom/detect does not answer; start the detection node")
        answered = threading.Event()
        future = self._detect.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        while not answered.wait(self._options.poll_s):
            self._check(deadline_s, "/uncom/detect did not answer in time")
        response = future.result()
        if not response.success:
            raise MotionError(f"looking again failed: {response.reason}")
        return scene_from_response(response)

    def _wait_for_picture(self, from_s: float, deadline_s: float) -> Detect.Request:
        while True:
            self._arrived.wait(self._options.poll_s)
            self._arrived.clear()
            self._check(deadline_s, "no picture came from the head camera, so I cannot look again")
            request = self._request_after(from_s)
            if request is not None:
                return request

    def _check(self, deadline_s: float, late: str) -> None:
        """Raise if looking was stopped, or took too long."""
        if self._stop.is_set():
            raise StoppedError("stopped on request")
        if self._now_s() > deadline_s:
            raise MotionError(late)

    def _request_after(self, stamp_s: float) -> Detect.Request | None:
        """Return a request for the latest picture, or None if it is older than a time [s] or not complete yet."""
        with self._lock:
            rgb, depth, info = (self._latest.get(name) for name in ("rgb", "depth", "info"))
        if rgb is None or depth is None or info is None or rgb.header.stamp != depth.header.stamp:
            return None
        taken_s = seconds_from_msg(rgb.header.stamp)
        if taken_s < stamp_s:
            return None
        frame, base = rgb.header.frame_id, self._base_frame
        try:
            matrix = self._tree.lookup(frame, base, taken_s)
        except TransformError:
            return None
        camera_in_base = stamped_transform_to_msg(StampedTransform(taken_s, base, frame, matrix))
        return Detect.Request(
            image=rgb,
            depth=depth,
            camera_info=info,
            has_transform=True,
            camera_in_base=camera_in_base,
            phrases=["objects"],
        )

    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9
