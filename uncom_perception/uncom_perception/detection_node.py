# SPDX-License-Identifier: Apache-2.0
"""Node that finds things on the table: services /uncom/detect, /uncom/segment and /uncom/estimate_depth."""

from __future__ import annotations

import dataclasses
import sys
from typing import Any

import numpy as np
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
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

from uncom_interfaces.srv import Detect, EstimateDepth, Segment
from uncom_perception.config import DetectionConfig
from uncom_perception.conversions import hands_from_msg, mask_to_msg, points_from_msgs, scene_to_response
from uncom_perception.depth.estimator import make_depth_estimator
from uncom_perception.objects.backends import make_detector
from uncom_perception.segmentation.backends import make_segmenter
from uncom_perception.types import Box


class DetectionNode(ConfiguredNode[DetectionConfig]):
    """Each service converts, calls one function of a back end, and answers; bad input is an answer with a reason."""

    def __init__(self, **node_options: Any) -> None:
        """Load the back ends and offer the services."""
        super().__init__("detection_node", DetectionConfig, **node_options)
        self._detector = make_detector(self.config.backend, self.config.lexicon)
        self._segmenter = make_segmenter(self.config.segmentation)
        self._estimator = make_depth_estimator(self.config.depth_backend)
        group = MutuallyExclusiveCallbackGroup()
        self.create_service(Detect, "/uncom/detect", self._detect, callback_group=group)
        self.create_service(Segment, "/uncom/segment", self._segment, callback_group=group)
        self.create_service(EstimateDepth, "/uncom/estimate_depth", self._estimate, callback_group=group)
        names = (self._detector.name, self._segmenter.name, self._estimator.name)
        self.get_logger().info("detection by {}; segmentation by {}; depth by {}".format(*names))

    def _detect(self, request: Detect.Request, response: Detect.Response) -> Detect.Response:
        try:
            image = rgb_from_msg(request.image)
            depth = depth_from_msg(request.depth) if len(request.depth.data) else None
            camera = camera_from_msg(request.camera_info) if request.camera_info.k[0] > 0.0 else None
            pose, frame = None, request.image.header.frame_id
            if request.has_transform:
                transform = stamped_transform_from_msg(request.camera_in_base)
                pose, frame = transform.matrix, transform.parent
            hands = hands_from_msg(request.hands)
            stamp = seconds_from_msg(request.image.header.stamp)
            scene = self._detector.detect(image, depth, camera, pose, list(request.phrases), hands, stamp)
        except UncomError as error:
            response.success, response.reason, response.backend = False, str(error), self._detector.name
            return response
        response = scene_to_response(dataclasses.replace(scene, frame_id=frame), response)
        response.header.stamp = request.image.header.stamp  # exactly, not through a float
        return response

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
            response.depth = depth_to_msg(self._estimator.estimate(rgb_from_msg(request.image)), request.image.header)
            response.success = True
        except UncomError as error:
            response.success, response.reason = False, str(error)
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node."""

    def make() -> Node:
        return DetectionNode()

    sys.exit(run_node(make, args))


if __name__ == "__main__":
    main()
