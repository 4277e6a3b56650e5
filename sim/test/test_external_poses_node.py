# SPDX-License-Identifier: Apache-2.0
"""The simulated estimator of poses, and what the detector makes of it, over real DDS."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_common.conversions import (
    camera_to_msg,
    depth_to_msg,
    header_to_msg,
    pose_to_msg,
    rgb_to_msg,
    stamped_transform_to_msg,
)
from uncom_common.transforms import StampedTransform, invert
from uncom_perception.conversions import models_from_msg, scene_from_response
from uncom_perception.detection_node import DetectionNode
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.driver.ros.conversions import sim_state_to_msg
from uncom_sim.external_poses_node import ExternalPosesNode
from uncom_sim.objects.catalogue import KINDS, model, natural_colour
from uncom_sim.pose_estimator.pose_estimator import mesh_of
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.types import ObjectState
from uncom_sim.world.scene_file import scene_from_dict
from uncom_sim.world.simulator import Simulator

from uncom_interfaces.msg import ObjectPoses, SimState
from uncom_interfaces.srv import Detect


class Graph:
    """Nodes in one process, and another that hears the estimates."""

    def __init__(self, domain):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.received, self.got = [], threading.Event()
        self.nodes = []
        self.other = self.add(rclpy.create_node("other", context=self.context))
        self.other.create_subscription(ObjectPoses, "/uncom/object_poses", self._keep, 10)
        self.truth = self.other.create_publisher(SimState, "/sim/state", 10)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()

    def add(self, node):
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def estimator(self, **parameters):
        given = [Parameter(name, value=value) for name, value in {"found": 1.0, **parameters}.items()]
        return self.add(ExternalPosesNode(context=self.context, parameter_overrides=given))

    def _keep(self, msg):
        self.received.append(msg)
        self.got.set()

    def estimate_of(self, state):
        """Tell the truth until an estimate of it comes."""
        while not self.got.wait(0.05):
            self.truth.publish(state)
        return self.received[-1]

    def detect(self, request):
        client = self.other.create_client(Detect, "/uncom/detect")
        assert client.wait_for_service(timeout_sec=20.0)
        done, future = threading.Event(), client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        assert done.wait(30.0)
        return scene_from_response(future.result())

    def close(self):
        self.executor.shutdown(timeout_sec=2.0)
        for node in self.nodes:
            node.destroy_node()
        rclpy.shutdown(context=self.context)
        self.thread.join(timeout=5.0)


@pytest.fixture
def graph():
    with DomainClaim() as claim:
        made = Graph(claim.domain)
        yield made
        made.close()


def truth_of(kind, place, stamp_s=3.5):
    pose = np.eye(4)
    pose[:3, 3] = place
    thing = ObjectState("a", kind, natural_colour(kind), pose, model(kind, natural_colour(kind)).size)
    return sim_state_to_msg([thing], [], stamp_s, (0, 0), person_done=False)


def test_poses_are_near_the_truth_and_carry_its_stamp_and_a_mesh(graph):
    """Positions are off by millimetres, not equal, and all things are found when all are to be found."""
    graph.estimator()
    state = truth_of("mug", (0.6, -0.1, 0.75))
    found = graph.estimate_of(state)
    assert found.header == state.header
    (mug,) = models_from_msg(found)
    assert mug.label == "mug"
    assert 0.0 < np.linalg.norm(mug.pose[:3, 3] - (0.6, -0.1, 0.75)) < 0.04
    assert mug.vertices == pytest.approx(mesh_of("mug")[0])
    assert np.array_equal(mug.triangles, mesh_of("mug")[1])


def test_an_estimator_without_meshes_gives_poses_alone(graph):
    graph.estimator(meshes=False)
    (mug,) = models_from_msg(graph.estimate_of(truth_of("mug", (0.6, -0.1, 0.75))))
    assert len(mug.vertices) == len(mug.triangles) == 0


def test_estimates_are_in_the_frame_of_the_base_as_it_is_now(graph):
    """The base has driven 10 cm ahead: what was 60 cm ahead of where it began is 50 cm ahead."""
    graph.estimator(sigma_m=1e-6, rate_hz=1000.0)
    odometry = graph.other.create_publisher(Odometry, "/mobile_base_controller/odom", 10)
    driven = np.eye(4)
    driven[0, 3] = 0.1
    msg = Odometry()
    msg.pose.pose = pose_to_msg(driven)
    for tick in range(400):
        odometry.publish(msg)
        graph.got.clear()
        (mug,) = models_from_msg(graph.estimate_of(truth_of("mug", (0.6, -0.1, 0.75), 3.5 + 0.01 * tick)))
        if mug.pose[0, 3] < 0.59:
            break
    assert mug.pose[:3, 3] == pytest.approx((0.5, -0.1, 0.75), abs=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_is_as_large_as_the_thing(kind):
    vertices, triangles = mesh_of(kind)
    assert np.ptp(vertices, axis=0) == pytest.approx(model(kind, natural_colour(kind)).size, abs=1e-6)
    assert triangles.min() == 0
    assert triangles.max() == len(vertices) - 1


@pytest.fixture(scope="module")
def picture():
    """What the robot sees of an apple and a cup, and the truth about them."""
    things = [{"id": "a", "kind": "apple", "x": 0.6, "y": 0.1}, {"id": "b", "kind": "cup", "x": 0.62, "y": -0.15}]
    simulator = Simulator(scene_from_dict({"objects": things, "say": "take the apple"}), 5)
    try:
        pose = invert(simulator.robot.frame("base_footprint")) @ simulator.robot.frame(CAMERA_FRAME)
        return (*simulator.render_camera(), pose, simulator.object_states(), simulator.time_s)
    finally:
        simulator.close()


def test_estimates_complete_what_is_seen_and_without_them_nothing_changes(graph, picture):
    """The truth's way to the detector leads through the estimator alone; its errors are taken out by what is seen."""
    rgb, depth, pose, states, time_s = picture
    header = header_to_msg(time_s, CAMERA_FRAME)
    request = Detect.Request(image=rgb_to_msg(rgb, header), depth=depth_to_msg(depth, header), phrases=["objects"])
    request.camera_info, request.has_transform = camera_to_msg(HEAD_CAMERA, header), True
    request.camera_in_base = stamped_transform_to_msg(StampedTransform(time_s, "base_footprint", CAMERA_FRAME, pose))
    graph.add(DetectionNode(context=graph.context))
    plain = graph.detect(request)
    again = graph.detect(request)
    assert all(d.model is None for d in plain.detections)
    for one, other in zip(plain.detections, again.detections, strict=True):
        assert np.array_equal(one.geometry.cloud, other.geometry.cloud)

    graph.estimator()
    graph.estimate_of(sim_state_to_msg(states, [], time_s, (0, 0), person_done=False))
    for _ in range(50):
        completed = graph.detect(request)
        if all(d.model is not None for d in completed.detections):
            break
    off_before = [off(plain, state) for state in states]
    off_after = [off(completed, state) for state in states]
    assert max(off_after) < 0.003
    assert off_before[0] > 0.004  # the far side of the apple


def off(scene, state):
    """How far the box of a thing is from the truth: its middle or its size, whichever is worse [m]."""
    thing = min(scene.detections, key=lambda d: np.linalg.norm(d.geometry.centroid - state.position))
    middle = np.linalg.norm(thing.geometry.centroid - state.position)
    return max(middle, *np.abs(np.sort(thing.geometry.size) - np.sort(state.size)))
