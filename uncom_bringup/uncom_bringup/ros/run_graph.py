# SPDX-License-Identifier: Apache-2.0
"""`uncom up`: the whole graph as processes, and a monitor that says what happens."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from uncom_bringup import output
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.graph.node_processes import GraphProcesses, ParameterValue
from uncom_bringup.graph.node_specs import DRIVER, EXECUTION_NODE, SIX_NODES
from uncom_bringup.graph.ros_domain import domain_from_text
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.monitor.run_record import Event
from uncom_bringup.report import progress

_DEFAULT_SCENARIO = "iv"


def _say(event: Event) -> None:
    words = progress.line(event)
    if words:
        output.emit(words)


def driver_parameters(scenario: str | None, scene: str | None, seed: int) -> dict[str, ParameterValue]:
    """Return the driver's parameters for a scenario or a scene file.

    Raises:
        BadInputError: both are given, or the file does not exist.
    """
    if scenario and scene:
        raise BadInputError("give --scenario or --scene, not both")
    if scene and not Path(scene).is_file():
        raise BadInputError(f"there is no scene file {scene}")
    place = {"scene_file": str(Path(scene).resolve())} if scene else {"scenario": scenario or _DEFAULT_SCENARIO}
    return {**place, "seed": seed}


def stay(
    *,
    sim: bool,
    scenario: str | None,
    scene: str | None,
    seed: int,
    start: bool,
    require_approval: bool,
    parameter_files: Sequence[Path],
    log_dir: Path,
) -> int:
    """Start the graph and stay until Ctrl-C; returns the exit status.

    Raises:
        GraphError: a node ended by itself.
        BadInputError: options that do not go together.
    """
    if not sim and (scenario or scene or start):
        raise BadInputError("--scenario, --scene and --start go with --sim")
    domain = domain_from_text(os.environ.get("ROS_DOMAIN_ID") or "0")
    with GraphProcesses(log_dir, domain, parameter_files) as graph:
        if sim:
            graph.start(DRIVER, driver_parameters(scenario, scene, seed))
        for spec in SIX_NODES:
            own: dict[str, ParameterValue] = {"use_sim_time": sim}
            if spec is EXECUTION_NODE:
                own["require_approval"] = require_approval
            graph.start(spec, own)
        output.note(f"starting {', '.join(graph.names)} on ROS domain {domain}; logs in {log_dir}; Ctrl-C ends it")
        _watch(graph, sim, start)
    return 0


def _watch(graph: GraphProcesses, sim: bool, start: bool) -> None:
    rclpy.init()
    clock = [Parameter("use_sim_time", value=sim)]
    monitor = MonitorNode(_say, keep_camera=False, keep_events=False, parameter_overrides=clock)
    client = monitor.create_client(Trigger, "/sim/start") if start else None
    executor = SingleThreadedExecutor()
    executor.add_node(monitor)
    try:
        while True:
            executor.spin_once(timeout_sec=0.2)
            graph.check()
            if client is not None and monitor.graph_is_up() and client.service_is_ready():
                client.call_async(Trigger.Request())
                client = None
    except (KeyboardInterrupt, ExternalShutdownException):
        output.note("stopping")
    finally:
        executor.shutdown(timeout_sec=1.0)
        monitor.destroy_node()
        rclpy.try_shutdown()
