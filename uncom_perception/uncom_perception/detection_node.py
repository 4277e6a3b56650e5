# SPDX-License-Identifier: Apache-2.0
"""Node that finds objects on the table: services /uncom/detect, /uncom/segment and /uncom/estimate_depth."""

from __future__ import annotations

import sys
from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import (
    camera_from_msg,
    depth_from_msg,
    depth_to_msg,
    rgb_from_msg,
    seconds_from_msg,
    stamped_transform_from_msg,
)
from uncom_common.exceptions import UncomError

from uncom_interfaces.msg import ObjectPoses
from uncom_interfaces.srv import Detect, EstimateDepth, Segment
from uncom_perception.config import DetectionConfig
from uncom_perception.conversions import (
    hands_from_msg,
    mask_to_msg,
    models_from_msg,
    points_from_msgs,
    scene_to_response,
)
from uncom_perception.depth.dpt_depth_estimator import table_scale
from uncom_perception.depth.make_depth_estimator import make_depth_estimator
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.frames import RawBuffer, read_stamp_ns
from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.detectors.make_detector import detector_from_config
from uncom_perception.objects.scene_detector import OutsidePoses, SceneDetector
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.segmentation.make_segmenter import segmenter_from_config
from uncom_perception.types import Box

_CAMERA = "/head_front_camera"


class DetectionNode(ConfiguredNode[DetectionConfig]):
    """Each service converts, calls one function of a back end, and answers; bad input is an answer with a reason."""

    def __init__(self, **node_options: Any) -> None:
        """Load the back ends and offer the services."""
        super().__init__("detection_node", DetectionConfig, **node_options)
        config = self.config
        self._segmenter = segmenter_from_config(config)
        detector = detector_from_config(config, self._segmenter)
        same_name = load_lexicon(config.lexicon or None).same
        self._detector = SceneDetector(detector, same_name, track=config.track_objects, warn=self._warn)
        self._estimator = make_depth_estimator(config.depth_backend, config.depth_model, config.device)
        self._poses: deque[bytes] = deque(maxlen=20)  # serialized: meshes are read only where somebody asks
        self._frames = RawBuffer(self.config.buffer_s)
        self._camera: CameraInfo | None = None
        group = MutuallyExclusiveCallbackGroup()
        self.create_service(Detect, "/uncom/detect", self._detect, callback_group=group)
        self.create_service(Segment, "/uncom/segment", self._segment, callback_group=group)
        self.create_service(EstimateDepth, "/uncom/estimate_depth", self._estimate, callback_group=group)
        self.create_subscription(ObjectPoses, "/uncom/object_poses", self._on_poses, 10, raw=True)
        if self.config.buffer_s > 0.0:
            self._subscribe_images()
        names = (self._detector.name, self._segmenter.name, self._estimator.name)
        self.get_logger().info("detection by {}; segmentation by {}; depth by {}".format(*names))

    def _subscribe_images(self) -> None:
        reliability = ReliabilityPolicy.RELIABLE if self.config.reliable_images else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=5, reliability=reliability)
        group = MutuallyExclusiveCallbackGroup()
        color, depth = f"{_CAMERA}/rgb/image_raw", f"{_CAMERA}/depth_registered/image_raw"
        self.create_subscription(Image, color, self._frames.add_image, qos, callback_group=group, raw=True)
        self.create_subscription(Image, depth, self._frames.add_depth, qos, callback_group=group, raw=True)
        self.create_subscription(CameraInfo, f"{_CAMERA}/rgb/camera_info", self._on_info, qos, callback_group=group)

    def _on_poses(self, msg: bytes) -> None:
        self._poses.append(msg)

    def _on_info(self, msg: CameraInfo) -> None:
        self._camera = msg

    def _detect(self, request: Detect.Request, response: Detect.Response) -> Detect.Response:
        try:
            if not len(request.image.data):
                self._from_buffer(request)
            image = rgb_from_msg(request.image)
            depth = depth_from_msg(request.depth) if len(request.depth.data) else None
            camera = camera_from_msg(request.camera_info) if request.camera_info.k[0] > 0.0 else None
            pose, frame = None, request.image.header.frame_id
            if request.has_transform:
                transform = stamped_transform_from_msg(request.camera_in_base)
                pose, frame = transform.matrix, transform.parent
            hands = hands_from_msg(request.hands)
            stamp = seconds_from_msg(request.image.header.stamp)
            camera_frame = request.image.header.frame_id
            view = RgbdFrame(image, depth, camera, pose, camera_frame, frame, stamp)
            outside = self._outside_poses(stamp)
            scene = self._detector.detect(view, list(request.phrases), hands, outside)
        except UncomError as error:
            response.success, response.reason, response.backend = False, str(error), self._detector.name
            return response
        response = scene_to_response(scene, response)
        response.header.stamp = request.image.header.stamp  # exactly, not through a float
        return response

    def _from_buffer(self, request: Detect.Request) -> None:
        """Put the buffered picture nearest to the stamp into a request.

        Raises:
            InvalidImageError: there is none.
        """
        found = self._frames.nearest(seconds_from_msg(request.stamp))
        if found is None:
            raise InvalidImageError(
                "the request has no image (its encoding is empty) and no camera image has come in yet; "
                f"send one, or see whether {_CAMERA}/rgb/image_raw is published"
            )
        request.image = deserialize_message(found.image, Image)
        if found.depth is not None:
            request.depth = deserialize_message(found.depth, Image)
        if request.camera_info.k[0] <= 0.0 and self._camera is not None:
            request.camera_info = self._camera

    def _outside_poses(self, stamp_s: float) -> OutsidePoses | None:
        """Return the poses of an outside estimator of about a time [s], if there are any."""
        near = [raw for raw in tuple(self._poses) if abs(_age_s(raw, stamp_s)) <= self.config.model_age_s]
        if not near:
            return None
        msg = deserialize_message(min(near, key=lambda raw: abs(_age_s(raw, stamp_s))), ObjectPoses)
        return OutsidePoses(seconds_from_msg(msg.header.stamp), msg.header.frame_id, models_from_msg(msg))

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=10.0)

    def _segment(self, request: Segment.Request, response: Segment.Response) -> Segment.Response:
        response.backend = self._segmenter.name
        try:
            image = rgb_from_msg(request.image)
            depth = depth_from_msg(request.depth) if len(request.depth.data) else None
            boxes = [Box(*(float(v) for v in four)) for four in np.array(request.boxes).reshape(-1, 4)]
            masks, scores = self._segmenter.segment(image, depth, points_from_msgs(request.points), boxes)
        except (UncomError, ValueError) as error:
            response.success, response.reason = False, str(error)
            return response
        response.success = True
        response.masks = [mask_to_msg(mask) for mask in masks]
        response.scores = [float(score) for score in scores]
        return response

    def _estimate(self, request: EstimateDepth.Request, response: EstimateDepth.Response) -> EstimateDepth.Response:
        response.backend = self._estimator.name
        try:
            depth = self._estimator.estimate(rgb_from_msg(request.image))
            response.depth = depth_to_msg(self._scaled(depth), request.image.header)
            response.success = True
        except UncomError as error:
            response.success, response.reason = False, str(error)
        return response

    def _scaled(self, depth: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Scale an estimated depth by the camera's height above the table, where both that and the camera are known."""
        height = self.config.camera_above_table_m
        if height <= 0.0 or self._camera is None:
            return depth
        factor = table_scale(depth, camera_from_msg(self._camera), height)
        if factor is None:
            self.get_logger().warning("the scale of the depth is not checked: no table seen in it")
            return depth
        return np.asarray(depth * np.float32(factor))


def _age_s(raw: bytes, stamp_s: float) -> float:
    return read_stamp_ns(raw) * 1e-9 - stamp_s


def main(args: list[str] | None = None) -> None:
    """Run the node."""

    def make() -> Node:
        return DetectionNode()

    sys.exit(run_node(make, args))


if __name__ == "__main__":
    main()
