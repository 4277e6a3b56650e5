# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes: parameters arrive, the dead are reported, everything ends; domain ids are not shared."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from uncom_bringup.exceptions import BadInputError, GraphError
from uncom_bringup.graph.node_processes import GraphProcesses, node_command, parameter_text
from uncom_bringup.graph.node_specs import SIX_NODES, NodeSpec
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_bringup.ros.composed_graph import node_class

TIMEOUT_S = 60.0
LANGUAGE = next(spec for spec in SIX_NODES if spec.name == "language_node")


def wait_for(condition):
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def dead(graph):
    try:
        graph.check()
    except GraphError as error:
        return error
    return None


@pytest.mark.parametrize("value", [True, False, 3, -0.25, "yes", 'a "quoted" \\ word', "12", [1, 2], ["a", "b"], [0.5]])
def test_parameter_values_survive_the_command_line(value):
    assert yaml.safe_load(parameter_text(value)) == value


def test_the_shipped_file_comes_first_and_single_parameters_last(tmp_path):
    command = node_command(LANGUAGE, {"backend": "grammar"}, [tmp_path / "mine.yaml"])
    files = [command[n + 1] for n, word in enumerate(command) if word == "--params-file"]
    assert files == [str(LANGUAGE.parameter_file), str(tmp_path / "mine.yaml")]
    assert command[-1] == 'backend:="grammar"'


def test_a_parameter_file_that_is_not_there_is_told_before_anything_starts(tmp_path):
    with pytest.raises(BadInputError, match=r"none\.yaml"):
        GraphProcesses(tmp_path, 1, [tmp_path / "none.yaml"])


def test_a_node_that_refuses_its_parameters_is_reported_with_its_words(tmp_path):
    with DomainClaim() as claim, GraphProcesses(tmp_path, claim.domain) as graph:
        graph.start(LANGUAGE, {"language": "klingon"})
        wait_for(lambda: dead(graph) is not None)
        error = dead(graph)
        assert error.node == "language_node"
        assert "klingon" in str(error)
        assert error.exit_status == 2
        assert "\n" not in str(error)


def test_a_node_that_is_killed_is_noticed_and_the_rest_is_stopped(tmp_path):
    with DomainClaim() as claim, GraphProcesses(tmp_path, claim.domain) as graph:
        graph.start(LANGUAGE)
        wait_for(lambda: "understanding" in (tmp_path / "language_node.log").read_text())
        victim = graph._running[0].process
        assert graph.cpu_times_s()["language_node"] > 0.0
        os.kill(victim.pid, signal.SIGKILL)
        wait_for(lambda: dead(graph) is not None)
        assert "signal 9" in str(dead(graph))
    assert victim.returncode is not None


def test_a_node_stops_on_request_by_itself(tmp_path):
    with DomainClaim() as claim:
        graph = GraphProcesses(tmp_path, claim.domain)
        graph.start(LANGUAGE)
        wait_for(lambda: "understanding" in (tmp_path / "language_node.log").read_text())
        process = graph._running[0].process
        graph.stop(timeout_s=TIMEOUT_S)
        assert process.returncode == 0
        assert "Traceback" not in (tmp_path / "language_node.log").read_text()


STARTER_PROGRAM = """
import sys, threading
from pathlib import Path
from uncom_bringup.graph.node_processes import GraphProcesses
from uncom_bringup.graph.node_specs import NodeSpec
graph = GraphProcesses(Path(sys.argv[1]), int(sys.argv[2]))
graph.start(NodeSpec("language_node", "uncom_language", "LanguageNode"))
print(graph._running[0].process.pid, flush=True)
threading.Event().wait()
"""


def test_no_node_outlives_a_starter_that_was_killed(tmp_path):
    with DomainClaim() as claim:
        command = [sys.executable, "-c", STARTER_PROGRAM, str(tmp_path), str(claim.domain)]
        starter = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        node = int(starter.stdout.readline())
        wait_for(lambda: "understanding" in (tmp_path / "language_node.log").read_text())
        starter.kill()
        starter.wait()
        wait_for(lambda: not is_running(node))


def is_running(pid: int) -> bool:
    """Whether a process is there and no zombie that nobody has asked for."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_module_that_does_not_exist_is_reported(tmp_path):
    with GraphProcesses(tmp_path, 1) as graph:
        graph.start(NodeSpec("no_such_node", "uncom_language", "NoSuchNode"))
        wait_for(lambda: dead(graph) is not None)
        assert "No module named" in str(dead(graph))


def test_two_claims_never_share_a_domain():
    claims = [DomainClaim() for _ in range(5)]
    assert len({claim.domain for claim in claims}) == 5
    for claim in claims:
        claim.close()


def test_the_users_domain_is_taken_as_it_is():
    with DomainClaim("42") as one, DomainClaim("42") as other:
        assert one.domain == other.domain == 42


@pytest.mark.parametrize("text", ["abc", "-1", "233", "1.5"])
def test_a_domain_id_that_is_none_is_told(text):
    with pytest.raises(BadInputError, match="ROS_DOMAIN_ID"):
        DomainClaim(text)


@pytest.mark.parametrize("spec", SIX_NODES, ids=lambda spec: spec.name)
def test_a_shipped_parameter_file_names_only_what_the_node_has(spec):
    config = node_class(spec).__orig_bases__[0].__args__[0]
    shipped = yaml.safe_load(spec.parameter_file.read_text(encoding="utf-8"))
    assert list(shipped) == [spec.name]
    values = shipped[spec.name]["ros__parameters"]
    assert set(values) <= set(config.__dataclass_fields__)
    config(**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})
