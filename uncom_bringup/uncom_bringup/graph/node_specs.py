# SPDX-License-Identifier: Apache-2.0
"""The nodes of the graph as data, in the one place that processes, launch file, composed graph and monitor read.

Only names stand here; the nodes themselves live in their packages. Nothing is imported but the standard library and
the topics, because the launch file reads this too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from uncom_bringup.graph import topics
from uncom_bringup.graph.topics import Topic

CONFIG_DIR = Path(__file__).parents[1] / "config"
DETECT_SERVICE = "/uncom/detect"


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """One node: its ROS name, its package, and its class there.

    inputs: the topics that it must subscribe to before it counts as ready; it may subscribe to more.
    """

    name: str
    package: str
    class_name: str
    inputs: tuple[Topic, ...] = ()

    @property
    def module(self) -> str:
        """Module to run with `python -m`."""
        return f"{self.package}.{self.name}"

    @property
    def parameter_file(self) -> Path | None:
        """The shipped parameter file, or None."""
        path = CONFIG_DIR / f"{self.name}.yaml"
        return path if path.exists() else None


SPEECH_NODE = NodeSpec("speech_node", "uncom_language", "SpeechNode", (topics.AUDIO, topics.AUDIO_INFO))
LANGUAGE_NODE = NodeSpec("language_node", "uncom_language", "LanguageNode", (topics.TRANSCRIPT,))
GESTURE_NODE = NodeSpec(
    "gesture_node",
    "uncom_perception",
    "GestureNode",
    (topics.RGB, topics.RGB_INFO, topics.DEPTH, topics.TRANSCRIPT, topics.SPEECH_STATUS),
)
# It serves `DETECT_SERVICE` and listens to nothing.
DETECTION_NODE = NodeSpec("detection_node", "uncom_perception", "DetectionNode")
REASONER_NODE = NodeSpec(
    "reasoner_node",
    "uncom_reasoner",
    "ReasonerNode",
    (topics.RGB, topics.RGB_INFO, topics.DEPTH, topics.TF, topics.TF_STATIC, topics.COMMAND, topics.HANDS),
)
EXECUTION_NODE = NodeSpec("execution_node", "uncom_tiago_exec", "ExecutionNode")
# The one that stands for the robot in simulation.
DRIVER = NodeSpec("driver_node", "uncom_sim", "DriverNode")

# Everything that understands, and nothing that moves.
UNDERSTANDING_NODES = (SPEECH_NODE, LANGUAGE_NODE, GESTURE_NODE, DETECTION_NODE, REASONER_NODE)
SIX_NODES = (*UNDERSTANDING_NODES, EXECUTION_NODE)
