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
from uncom_bringup.graph.node_specs import DRIVER, EXECUTION_NODE, SIX_NODES

_PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"


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
    for spec in SIX_NODES:
        parameters: list[object] = [str(config / f"{spec.name}.yaml"), {"use_sim_time": sim}]
        if spec is EXECUTION_NODE:
            parameters.append({"require_approval": require_approval})
        if extra:
            parameters.append(extra)
        nodes.append(
            Node(
                package=spec.package,
                executable=spec.name,
                name=spec.name,
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
            Node(package=DRIVER.package, executable=DRIVER.name, name=DRIVER.name, output="screen", parameters=[scene])
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
