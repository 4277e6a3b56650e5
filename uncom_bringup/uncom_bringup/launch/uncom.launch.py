# SPDX-License-Identifier: Apache-2.0
"""Start the graph with ROS 2's own tools: `ros2 launch uncom_bringup uncom.launch.py`.

Arguments: sim (with the simulated TIAGo++), require_approval (empty: true on the robot, false in the simulator),
params_file (parameters over the shipped ones), log_level.
"""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

_PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"
PACKAGES = {
    "speech_node": "uncom_language",
    "language_node": "uncom_language",
    "gesture_node": "uncom_perception",
    "detection_node": "uncom_perception",
    "reasoner_node": "uncom_reasoner",
    "execution_node": "uncom_tiago_exec",
}


def _truth(text: str, argument: str) -> bool:
    if text.lower() in ("true", "1", "yes"):
        return True
    if text.lower() in ("false", "0", "no"):
        return False
    raise RuntimeError(f"launch argument {argument}:={text!r} is neither true nor false")


def _nodes(context: LaunchContext) -> list[Node]:
    """Make the nodes once the arguments are known."""
    config = Path(get_package_share_directory("uncom_bringup")) / "config"
    sim = _truth(LaunchConfiguration("sim").perform(context), "sim")
    approval = LaunchConfiguration("require_approval").perform(context)
    extra = LaunchConfiguration("params_file").perform(context)
    level = LaunchConfiguration("log_level").perform(context)
    require_approval = _truth(approval, "require_approval") if approval else not sim

    nodes = []
    for name, package in PACKAGES.items():
        parameters: list[object] = [str(config / f"{name}.yaml"), {"use_sim_time": sim}]
        if name == "execution_node":
            parameters.append({"require_approval": require_approval})
        if extra:
            parameters.append(extra)
        nodes.append(
            Node(
                package=package,
                executable=name,
                name=name,
                output="screen",
                parameters=parameters,
                arguments=["--ros-args", "--log-level", level],
            )
        )
    if sim:
        scene = {
            "scenario": LaunchConfiguration("scenario").perform(context),
            "seed": int(LaunchConfiguration("seed").perform(context)),
        }
        nodes.append(
            Node(package="uncom_sim", executable="driver_node", name="driver_node", output="screen", parameters=[scene])
        )
    return nodes


def generate_launch_description() -> LaunchDescription:
    """Describe the graph."""
    config = Path(get_package_share_directory("uncom_bringup")) / "config"
    return LaunchDescription(
        [
            DeclareLaunchArgument("sim", default_value="false", description="with the simulated TIAGo++"),
            DeclareLaunchArgument("scenario", default_value="iv", description="with sim: what is on the table"),
            DeclareLaunchArgument("seed", default_value="0", description="with sim: places, voice, hand, light"),
            DeclareLaunchArgument(
                "require_approval", default_value="", description="ask before every motion (default: on the robot)"
            ),
            DeclareLaunchArgument("params_file", default_value="", description="parameters over the shipped ones"),
            DeclareLaunchArgument("log_level", default_value="info"),
            # Shared memory large enough for camera images; see the file. Whoever has a profile keeps it.
            SetEnvironmentVariable(_PROFILE, EnvironmentVariable(_PROFILE, default_value=str(config / "fastdds.xml"))),
            OpaqueFunction(function=_nodes),
        ]
    )
