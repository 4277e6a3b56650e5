# SPDX-License-Identifier: Apache-2.0
"""Each node, started alone, offers what is declared here; and none of the six listens to the truth."""

from __future__ import annotations

import time
from dataclasses import dataclass

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from uncom_bringup.graph.node_specs import SIX_NODES
from uncom_bringup.monitor.conversions import message_class
from uncom_bringup.ros.composed_graph import ComposedGraph

TIMEOUT_S = 60.0
CAMERA = "/head_front_camera"
INTERFACES = "uncom_interfaces/msg/"


@dataclass(frozen=True)
class Declared:
    """What a node publishes, subscribes and serves at least, and some of its parameters."""

    publishes: dict[str, str]
    subscribes: dict[str, str]
    services: dict[str, str]
    parameters: tuple[str, ...]


TABLE = {
    "speech_node": Declared(
        {"/uncom/transcript": INTERFACES + "Transcript", "/uncom/speech_status": INTERFACES + "SpeechStatus"},
        {"/audio": "audio_common_msgs/msg/AudioDataStamped", "/audio_info": "audio_common_msgs/msg/AudioInfo"},
        {},
        ("backend", "use_sim_time"),
    ),
    "language_node": Declared(
        {"/uncom/command": INTERFACES + "Command"},
        {"/uncom/transcript": INTERFACES + "Transcript"},
        {},
        ("backend", "use_sim_time"),
    ),
    "gesture_node": Declared(
        {"/uncom/hands": INTERFACES + "Hands"},
        {
            f"{CAMERA}/rgb/image_raw": "sensor_msgs/msg/Image",
            f"{CAMERA}/rgb/camera_info": "sensor_msgs/msg/CameraInfo",
            f"{CAMERA}/depth_registered/image_raw": "sensor_msgs/msg/Image",
        },
        {},
        ("reliable_images", "use_sim_time"),
    ),
    "detection_node": Declared(
        {},
        {},
        {
            "/uncom/detect": "uncom_interfaces/srv/Detect",
            "/uncom/segment": "uncom_interfaces/srv/Segment",
            "/uncom/estimate_depth": "uncom_interfaces/srv/EstimateDepth",
        },
        ("use_sim_time",),
    ),
    "reasoner_node": Declared(
        {
            "/uncom/grounded_command": INTERFACES + "GroundedCommand",
            "/uncom/explanation": INTERFACES + "Explanation",
            "/uncom/annotated": "sensor_msgs/msg/Image",
        },
        {
            "/uncom/command": INTERFACES + "Command",
            "/uncom/hands": INTERFACES + "Hands",
            f"{CAMERA}/rgb/image_raw": "sensor_msgs/msg/Image",
            f"{CAMERA}/rgb/camera_info": "sensor_msgs/msg/CameraInfo",
            f"{CAMERA}/depth_registered/image_raw": "sensor_msgs/msg/Image",
            "/tf": "tf2_msgs/msg/TFMessage",
            "/tf_static": "tf2_msgs/msg/TFMessage",
        },
        {},
        ("reliable_images", "use_sim_time"),
    ),
    "execution_node": Declared(
        {"/uncom/execution_status": INTERFACES + "ExecutionStatus"},
        {
            "/uncom/grounded_command": INTERFACES + "GroundedCommand",
            "/uncom/answer": INTERFACES + "Answer",
            "/uncom/stop": "std_msgs/msg/Empty",
            "/joint_states": "sensor_msgs/msg/JointState",
            "/robot_description": "std_msgs/msg/String",
        },
        {},
        ("require_approval", "use_sim_time"),
    ),
}


class Observer:
    """A bare node of another participant that reads the graph."""

    def __init__(self, domain: int):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("observer", context=self.context)

    def close(self) -> None:
        self.node.destroy_node()
        self.context.try_shutdown()

    def wait_for(self, names: set[str]) -> None:
        deadline = time.monotonic() + TIMEOUT_S
        while not names <= set(self.node.get_node_names()):
            assert time.monotonic() < deadline, f"only {self.node.get_node_names()} came up"
            time.sleep(0.02)

    def read(self, read, name: str, expected: dict[str, str]) -> dict[str, list[str]]:
        """Read until what is expected has been discovered, or time is up."""
        deadline = time.monotonic() + 10.0
        while True:
            found = {topic: list(types) for topic, types in read(name, "/")}
            if expected.keys() <= found.keys() or time.monotonic() > deadline:
                return found
            time.sleep(0.02)


@pytest.fixture
def observer(domain):
    observer = Observer(domain)
    yield observer
    observer.close()


@pytest.mark.parametrize("spec", SIX_NODES, ids=lambda spec: spec.name)
def test_a_node_alone_offers_what_is_declared(spec, domain, observer):
    declared = TABLE[spec.name]
    with ComposedGraph(domain, [spec]) as graph:
        node = graph.nodes[spec.name]
        observer.wait_for({spec.name})
        published = observer.read(observer.node.get_publisher_names_and_types_by_node, spec.name, declared.publishes)
        subscribed = observer.read(observer.node.get_subscriber_names_and_types_by_node, spec.name, declared.subscribes)
        served = observer.read(observer.node.get_service_names_and_types_by_node, spec.name, declared.services)
        for expected, found in (
            (declared.publishes, published),
            (declared.subscribes, subscribed),
            (declared.services, served),
        ):
            assert {name: found.get(name) for name in expected} == {name: [kind] for name, kind in expected.items()}
        for parameter in declared.parameters:
            assert node.has_parameter(parameter)


def test_none_of_the_six_nodes_listens_to_the_truth(domain, observer):
    with ComposedGraph(domain):
        names = {spec.name for spec in SIX_NODES}
        observer.wait_for(names)
        for name in names:
            subscribed = observer.read(
                observer.node.get_subscriber_names_and_types_by_node, name, TABLE[name].subscribes
            )
            assert set(TABLE[name].subscribes) <= set(subscribed)
            assert not [topic for topic in subscribed if topic.startswith("/sim")]
            clients = dict(observer.node.get_client_names_and_types_by_node(name, "/"))
            assert not [service for service in clients if service.startswith("/sim")]


def test_a_subscription_to_the_truth_would_be_noticed(domain, observer):
    """The test above can fail: a node that does listen to /sim/state is seen doing so."""
    with ComposedGraph(domain, []) as graph:
        spy = Node("spy", context=graph.context)
        spy.create_subscription(message_class("uncom_interfaces/msg/SimState"), "/sim/state", lambda _: None, 10)
        graph.add(spy)
        observer.wait_for({"spy"})
        subscribed = observer.read(
            observer.node.get_subscriber_names_and_types_by_node, "spy", {"/sim/state": "uncom_interfaces/msg/SimState"}
        )
        assert "/sim/state" in subscribed
