# SPDX-License-Identifier: Apache-2.0
"""Both nodes over real DDS."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import rclpy
from perception_scenes import CAMERA, FRAME, POSE, overlap, takes
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from uncom_common.conversions import (
    camera_to_msg,
    depth_to_msg,
    header_to_msg,
    rgb_to_msg,
    stamped_transform_to_msg,
)
from uncom_common.transforms import StampedTransform
from uncom_perception.conversions import hands_from_msg, mask_from_msg, models_to_msg, scene_from_response
from uncom_perception.detection_node import DetectionNode
from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.frames import FrameQueue
from uncom_perception.gesture_node import GestureNode
from uncom_perception.types import ObjectModel

from uncom_interfaces.msg import Hands, ObjectPoses
from uncom_interfaces.srv import Detect, EstimateDepth, Segment

DOMAIN = 62
SCENE = {
    "objects": [
        {"id": "lemon", "kind": "lemon", "x": 0.58, "y": 0.05},
        {"id": "bowl", "kind": "bowl", "colour": "blue", "x": 0.62, "y": -0.2},
    ],
    "say": "put this lemon in this bowl",
    "point_object": "lemon",
    "point_target": "bowl",
}


@pytest.fixture(scope="module")
def pictures():
    return takes(SCENE, 1, (None, "object"))


@pytest.fixture
def graph():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    executor = MultiThreadedExecutor(num_threads=3, context=context)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    nodes = []

    def add(node):
        nodes.append(node)
        executor.add_node(node)
        return node

    yield context, add
    executor.shutdown(timeout_sec=2.0)
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown(context=context)
    thread.join(timeout=5.0)


def call(add, context, kind, name, request):
    node = add(rclpy.create_node("asker", context=context))
    client = node.create_client(kind, name)
    assert client.wait_for_service(timeout_sec=20.0)
    done = threading.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda _: done.set())
    assert done.wait(30.0)
    return future.result()


def request_of(picture, phrases, *, with_pose=True):
    header = header_to_msg(7.25, FRAME)
    request = Detect.Request(image=rgb_to_msg(picture.rgb, header), depth=depth_to_msg(picture.depth, header))
    request.camera_info = camera_to_msg(CAMERA, header)
    request.phrases = phrases
    if with_pose:
        request.has_transform = True
        request.camera_in_base = stamped_transform_to_msg(StampedTransform(7.25, "base_footprint", FRAME, POSE))
    return request


def test_detection_answers_in_the_base_frame(graph, pictures):
    """With the camera's pose geometry is in the base frame, and the named thing comes first."""
    context, add = graph
    add(DetectionNode(context=context))
    response = call(add, context, Detect, "/uncom/detect", request_of(pictures[0], ["lemon", "blue bowl"]))
    assert response.success, response.reason
    scene = scene_from_response(response)
    assert (scene.frame_id, scene.stamp_s) == ("base_footprint", 7.25)
    for i, name in enumerate(("lemon", "bowl")):
        best = max(scene.detections, key=lambda d: d.phrase_scores[i])
        assert overlap(best.mask, pictures[0].masks[name]) > 0.5
        assert np.linalg.norm(best.geometry.centroid[:2] - pictures[0].places[name][:2]) < 0.03
    assert scene.table.height_m == pytest.approx(0.72, abs=0.01)


def test_a_picture_is_found_by_its_stamp_and_things_keep_their_names(graph, pictures):
    """A request without image is answered from the camera's buffer; poses from outside go to what they lie in."""
    context, add = graph
    detection = add(DetectionNode(context=context))
    camera = add(rclpy.create_node("camera", context=context))
    color = camera.create_publisher(Image, "/head_front_camera/rgb/image_raw", 5)
    depth = camera.create_publisher(Image, "/head_front_camera/depth_registered/image_raw", 5)
    info = camera.create_publisher(CameraInfo, "/head_front_camera/rgb/camera_info", 5)
    poses = camera.create_publisher(ObjectPoses, "/uncom/object_poses", 5)
    topics = (color, depth, info, poses)
    clock = threading.Event()
    while not all(topic.get_subscription_count() for topic in topics):
        clock.wait(0.02)
    header = header_to_msg(7.25, FRAME)
    place = np.eye(4)
    place[:3, 3] = (np.linalg.inv(POSE) @ [*pictures[0].places["bowl"], 1.0])[:3]
    outside = ObjectModel("bowl", 0.9, place, np.zeros((0, 3)), np.zeros((0, 3), int))
    poses.publish(models_to_msg([outside], header))
    info.publish(camera_to_msg(CAMERA, header))
    color.publish(rgb_to_msg(pictures[0].rgb, header))
    depth.publish(depth_to_msg(pictures[0].depth, header))
    whole = request_of(pictures[0], ["lemon"])
    asked = Detect.Request(phrases=["lemon"], has_transform=True, camera_in_base=whole.camera_in_base)
    asked.stamp.sec = 7
    while not (response := call(add, context, Detect, "/uncom/detect", asked)).table.height:
        clock.wait(0.05)  # until picture, depth and camera have come in
    assert response.success, response.reason
    assert response.header.stamp == header.stamp
    scene = scene_from_response(response)
    again = scene_from_response(call(add, context, Detect, "/uncom/detect", whole))
    assert [d.track for d in scene.detections] == [d.track for d in again.detections]
    assert all(d.track for d in scene.detections)
    bowl = max(again.detections, key=lambda d: overlap(d.mask, pictures[0].masks["bowl"]))
    assert bowl.model is not None
    assert bowl.model.pose[:3, 3] == pytest.approx(pictures[0].places["bowl"], abs=1e-6)
    assert detection.config.buffer_s > 0.0


def test_without_a_pose_the_answer_is_in_the_camera_frame(graph, pictures):
    """The frame's name says so."""
    context, add = graph
    add(DetectionNode(context=context))
    response = call(add, context, Detect, "/uncom/detect", request_of(pictures[0], ["bowl"], with_pose=False))
    assert response.success
    assert response.header.frame_id == FRAME
    assert all(d.centroid.z > 0.4 for d in response.detections)


def test_bad_requests_are_answered_with_a_reason(graph, pictures):
    """An empty image, and a depth back end that there is not."""
    context, add = graph
    add(DetectionNode(context=context))
    response = call(add, context, Detect, "/uncom/detect", Detect.Request())
    assert not response.success
    assert "encoding" in response.reason
    image = rgb_to_msg(pictures[0].rgb, header_to_msg(1.0, FRAME))
    answer = call(add, context, EstimateDepth, "/uncom/estimate_depth", EstimateDepth.Request(image=image))
    assert not answer.success
    assert "no depth back end" in answer.reason


def test_segment_gives_the_thing_in_a_box(graph, pictures):
    """The mask of a box about the bowl overlaps the bowl."""
    context, add = graph
    add(DetectionNode(context=context))
    truth = pictures[0].masks["bowl"]
    v, u = np.nonzero(truth)
    header = header_to_msg(1.0, FRAME)
    request = Segment.Request(image=rgb_to_msg(pictures[0].rgb, header))
    request.boxes = [float(x) for x in (u.min(), v.min(), u.max(), v.max())]
    response = call(add, context, Segment, "/uncom/segment", request)
    assert response.success, response.reason
    assert len(response.masks) == 1
    assert overlap(mask_from_msg(response.masks[0]), truth) > 0.6
    assert 0.0 <= response.scores[0] <= 1.0


def test_unknown_back_ends_are_refused_by_name(graph):
    """The error lists the known ones; no other back end steps in."""
    context, _ = graph
    for name in ("backend", "segmentation", "depth_backend"):
        options = [Parameter(name, value="sorcery")]
        with pytest.raises(UnknownBackendError, match=r"'sorcery' is not known; choose one of: \w+"):
            DetectionNode(context=context, parameter_overrides=options)
    with pytest.raises(UnknownBackendError, match="mediapipe"):
        GestureNode(context=context, parameter_overrides=[Parameter("backend", value="sorcery")])


def test_every_image_gets_its_hands(graph, pictures):
    """Hands are published for each image with its very stamp, in order; the pointing one has a metric ray."""
    context, add = graph
    add(GestureNode(context=context))
    node = add(rclpy.create_node("camera", context=context))
    received, enough = [], threading.Event()

    def on_hands(msg):
        received.append(msg)
        if len(received) == 4:
            enough.set()

    node.create_subscription(Hands, "/uncom/hands", on_hands, 10)
    topics = "/head_front_camera/rgb/image_raw", "/head_front_camera/depth_registered/image_raw"
    rgb, depth = (node.create_publisher(Image, topic, 10) for topic in topics)
    info = node.create_publisher(CameraInfo, "/head_front_camera/rgb/camera_info", 10)
    ready = threading.Event()
    check = node.create_timer(
        0.05, lambda: ready.set() if min(p.get_subscription_count() for p in (rgb, depth, info)) else None
    )
    assert ready.wait(20.0)
    check.cancel()
    stamps = [1.000000001, 1.125, 1.25, 1.375]
    for stamp, picture in zip(stamps, [pictures[0], pictures[1], pictures[1], pictures[1]], strict=True):
        header = header_to_msg(stamp, FRAME)
        info.publish(camera_to_msg(CAMERA, header))
        depth.publish(depth_to_msg(picture.depth, header))
        rgb.publish(rgb_to_msg(picture.rgb, header))
    assert enough.wait(60.0)
    frames = [hands_from_msg(msg) for msg in received]
    assert [f.stamp_s for f in frames] == pytest.approx(stamps, abs=1e-9)
    assert frames[0].hands == ()
    assert frames[3].pointing_hand is not None
    assert frames[3].hands[frames[3].pointing_hand].ray.metric is not None


def test_the_queue_drops_the_oldest_and_waits_for_depth():
    """It never grows, pairs by stamp, and gives up on depth that does not come."""
    queue = FrameQueue(2, 0.05)
    for key in (1, 2, 3):
        queue.add_image(key, f"image {key}")
    queue.add_depth(2, "depth 2")
    assert queue.dropped == 1
    assert queue.take() == ("image 2", "depth 2")
    assert queue.take() == ("image 3", None)
    queue.close()
    assert queue.take() is None
