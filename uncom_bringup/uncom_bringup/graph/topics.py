# SPDX-License-Identifier: Apache-2.0
"""The topics of the graph as data: what is recorded, replayed, and said by whom."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Role(Enum):
    """Who says it."""

    SENSE = "sense"  # the robot, or what stands for it
    OWN = "own"  # our nodes
    TRUTH = "truth"  # the simulator's scorer


class Form(Enum):
    """How it is stored."""

    PLAIN = "plain"
    IMAGE = "image"  # as <topic>/compressed
    DEPTH = "depth"  # as <topic>/compressedDepth


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic; `latched` is transient local durability, depth the queue of its subscribers."""

    name: str
    type_name: str
    role: Role = Role.OWN
    latched: bool = False
    form: Form = Form.PLAIN
    depth: int = 50

    @property
    def stored_name(self) -> str:
        """Name in a bag."""
        suffix = {Form.PLAIN: "", Form.IMAGE: "/compressed", Form.DEPTH: "/compressedDepth"}
        return self.name + suffix[self.form]


AUDIO = Topic("/audio", "audio_common_msgs/msg/AudioDataStamped", Role.SENSE, depth=500)
AUDIO_INFO = Topic("/audio_info", "audio_common_msgs/msg/AudioInfo", Role.SENSE, latched=True)
CAMERA = "/head_front_camera"
RGB = Topic(f"{CAMERA}/rgb/image_raw", "sensor_msgs/msg/Image", Role.SENSE, form=Form.IMAGE, depth=10)
RGB_INFO = Topic(f"{CAMERA}/rgb/camera_info", "sensor_msgs/msg/CameraInfo", Role.SENSE, depth=10)
DEPTH = Topic(f"{CAMERA}/depth_registered/image_raw", "sensor_msgs/msg/Image", Role.SENSE, form=Form.DEPTH, depth=10)
DEPTH_INFO = Topic(f"{CAMERA}/depth_registered/camera_info", "sensor_msgs/msg/CameraInfo", Role.SENSE, depth=10)
TF = Topic("/tf", "tf2_msgs/msg/TFMessage", Role.SENSE, depth=200)
TF_STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage", Role.SENSE, latched=True)
JOINT_STATES = Topic("/joint_states", "sensor_msgs/msg/JointState", Role.SENSE, depth=200)
ROBOT_DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", Role.SENSE, latched=True)
ODOMETRY = Topic("/mobile_base_controller/odom", "nav_msgs/msg/Odometry", Role.SENSE, depth=200)

TRANSCRIPT = Topic("/uncom/transcript", "uncom_interfaces/msg/Transcript")
SPEECH_STATUS = Topic("/uncom/speech_status", "uncom_interfaces/msg/SpeechStatus")
COMMAND = Topic("/uncom/command", "uncom_interfaces/msg/Command")
HANDS = Topic("/uncom/hands", "uncom_interfaces/msg/Hands")
GROUNDED_COMMAND = Topic("/uncom/grounded_command", "uncom_interfaces/msg/GroundedCommand")
EXPLANATION = Topic("/uncom/explanation", "uncom_interfaces/msg/Explanation")
ANNOTATED = Topic("/uncom/annotated", "sensor_msgs/msg/Image", form=Form.IMAGE)
QUESTION = Topic("/uncom/question", "uncom_interfaces/msg/Question")
ANSWER = Topic("/uncom/answer", "uncom_interfaces/msg/Answer")
SAY = Topic("/uncom/say", "std_msgs/msg/String")
STOP = Topic("/uncom/stop", "std_msgs/msg/Empty")
EXECUTION_STATUS = Topic("/uncom/execution_status", "uncom_interfaces/msg/ExecutionStatus", latched=True, depth=10)

SIM_STATE = Topic("/sim/state", "uncom_interfaces/msg/SimState", Role.TRUTH)

SENSES = (
    AUDIO,
    AUDIO_INFO,
    RGB,
    RGB_INFO,
    DEPTH,
    DEPTH_INFO,
    TF,
    TF_STATIC,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    ODOMETRY,
)
OWN = (
    TRANSCRIPT,
    SPEECH_STATUS,
    COMMAND,
    HANDS,
    GROUNDED_COMMAND,
    EXPLANATION,
    ANNOTATED,
    QUESTION,
    ANSWER,
    SAY,
    STOP,
    EXECUTION_STATUS,
)
RECORDED = (*SENSES, *OWN, SIM_STATE)
# Prefixes of what a replay leaves to the live graph.
NOT_REPLAYED = ("/uncom/", "/sim/", "/clock", "/rosout", "/parameter_events")
