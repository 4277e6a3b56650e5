# SPDX-License-Identifier: Apache-2.0
"""The rules that keep the rooms apart hold in every source file."""

from __future__ import annotations

import re

import pytest
from architecture import PACKAGES, ROOT, Module, modules

MESSAGES = frozenset(
    {
        "action_msgs",
        "audio_common_msgs",
        "builtin_interfaces",
        "control_msgs",
        "geometry_msgs",
        "nav_msgs",
        "rcl_interfaces",
        "rosgraph_msgs",
        "sensor_msgs",
        "std_msgs",
        "std_srvs",
        "tf2_msgs",
        "trajectory_msgs",
        "uncom_interfaces",
    }
)
ALL = list(modules())
# uncom_common.configured_node is the base of every node, and so a node file by name.
BELOW = {  # what a package may import of ours
    "uncom_common": set(),
    "uncom_language": {"uncom_common"},
    "uncom_perception": {"uncom_common"},
    "uncom_reasoner": {"uncom_common", "uncom_language", "uncom_perception"},
    "uncom_tiago_exec": {"uncom_common", "uncom_perception"},
    "uncom_bringup": {"uncom_common", "uncom_language", "uncom_perception", "uncom_reasoner", "uncom_sim"},
    # Its benchmarks measure the others.
    "uncom_sim": {
        "uncom_common",
        "uncom_bringup",
        "uncom_language",
        "uncom_perception",
        "uncom_reasoner",
        "uncom_tiago_exec",
    },
}


def knows_ros(module: Module) -> bool:
    return (
        "ros" in module.path.relative_to(ROOT).parts
        or module.defines_node
        or module.path.name == "conversions.py"
        or module.path.parent.name == "launch"
    )


def test_there_is_source_of_every_package():
    assert {module.package for module in ALL} == set(PACKAGES)


@pytest.mark.parametrize(
    "module", [m for m in ALL if not knows_ros(m) and m.package != "uncom_sim"], ids=lambda m: m.name
)
def test_only_nodes_conversions_and_launch_files_know_ros(module):
    assert not module.imports_any("rclpy", "launch", "launch_ros", *MESSAGES)


@pytest.mark.parametrize("module", [m for m in ALL if m.package != "uncom_sim"], ids=lambda m: m.name)
def test_only_the_simulator_knows_pybullet(module):
    assert not module.imports_any("pybullet", "pybullet_data")


@pytest.mark.parametrize("module", ALL, ids=lambda m: m.name)
def test_packages_import_only_what_lies_below_them(module):
    ours = {name.split(".")[0] for name in module.imports} & set(PACKAGES) - {module.package}
    assert ours <= BELOW[module.package]


@pytest.mark.parametrize("module", ALL, ids=lambda m: m.name)
def test_no_package_imports_another_ones_node(module):
    # The base of all nodes is nobody's node, and the demo listens with bringup's own listeners.
    shared = {"uncom_common.configured_node"}
    if module.package == "uncom_sim":
        shared |= {"uncom_bringup.monitor.monitor_node", "uncom_bringup.replay.recorder_node"}
    foreign = {name for name in module.imports if name.split(".")[0] in set(PACKAGES) - {module.package}}
    nodes = {name for name in foreign if re.search(r"_node(\.[A-Za-z]\w*)?$", name)}
    assert not {name for name in nodes if not name.startswith(tuple(shared))}


def test_a_file_is_called_a_node_where_it_defines_one():
    named = {m.name for m in ALL if m.path.name.endswith("_node.py")}
    assert named == {m.name for m in ALL if m.defines_node}


@pytest.mark.parametrize("module", [m for m in ALL if m.path.name.endswith("_node.py")], ids=lambda m: m.name)
def test_no_node_of_the_graph_imports_the_simulator(module):
    if module.package != "uncom_sim":
        assert not module.imports_any("uncom_sim")


def test_only_the_demo_and_the_benchmarks_reach_for_the_simulator():
    reaching = {m.name for m in ALL if m.package == "uncom_bringup" and m.imports_any("uncom_sim")}
    commands = "uncom_bringup/uncom_bringup/commands"
    allowed = {f"{commands}/demo.py"}
    assert {name for name in reaching if not name.startswith(f"{commands}/bench")} <= allowed


@pytest.mark.parametrize("module", ALL, ids=lambda m: m.name)
def test_every_file_says_its_licence_first(module):
    text = module.path.read_text(encoding="utf-8")
    assert not text or "# SPDX-License-Identifier: Apache-2.0" in text.splitlines()[:2]


@pytest.mark.parametrize("package", sorted(PACKAGES))
def test_a_package_root_imports_nothing(package):
    """Importing a value type must not pull in a recogniser."""
    init = next(m for m in ALL if m.path == PACKAGES[package] / "__init__.py")
    assert not init.imports


def test_tests_lie_in_files_of_unique_names():
    """The root run of pytest needs it."""
    names = [path.name for path in ROOT.glob("*/test/**/test_*.py")] + [p.name for p in ROOT.glob("test/test_*.py")]
    assert len(names) == len(set(names))
