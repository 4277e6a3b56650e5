# SPDX-License-Identifier: Apache-2.0
"""Write docs/reference/ from the code: `./uncom exec python docs/generate_reference.py [--check]`.

Each node is made for real, alone in its process's ROS context, and asked for its publishers, subscriptions, services,
actions and parameters; tunables come from the option classes. With --check nothing is written, and the exit status is 1
where a page is not what the code says.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.action import get_action_client_names_and_types_by_node, get_action_server_names_and_types_by_node
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from uncom_bringup.graph.node_specs import SIX_NODES, NodeSpec
from uncom_common.parameters import usable_values
from uncom_common.tunables import Tunable, find_tunables

REFERENCE = Path(__file__).resolve().parent / "reference"
INTERFACES = Path(__file__).resolve().parents[1] / "uncom_interfaces"
PACKAGES = (
    "uncom_common",
    "uncom_language",
    "uncom_perception",
    "uncom_reasoner",
    "uncom_tiago_exec",
    "uncom_bringup",
    "uncom_sim",
)
OF_EVERY_NODE = (
    "rosout",
    "parameter_events",
    "describe_parameters",
    "get_parameter",
    "list_parameters",
    "set_parameter",
    "get_type_description",
)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def type_name(kind: type) -> str:
    """Return the name of a message, service or action class as ROS spells it."""
    package, group = kind.__module__.split(".")[:2]
    return f"{package}/{group}/{kind.__name__}"


def quality(profile: QoSProfile) -> str:
    """Return a quality of service in words."""
    reliable = "reliable" if profile.reliability == ReliabilityPolicy.RELIABLE else "best effort"
    latched = ", latched" if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL else ""
    return f"{reliable}, depth {profile.depth}{latched}"


def connections(node: Node) -> Iterator[tuple[str, str, str, str]]:
    """Yield what a node offers and takes: kind, name, type, quality of service."""
    for kind, found in (("publishes", node.publishers), ("subscribes", node.subscriptions)):
        for item in found:
            yield kind, item.topic_name, type_name(item.msg_type), quality(item.qos_profile)
    for kind, services in (("serves", node.services), ("calls", node.clients)):
        for item in services:
            yield kind, item.srv_name, type_name(item.srv_type), ""
    actions = (
        ("serves action", get_action_server_names_and_types_by_node),
        ("calls action", get_action_client_names_and_types_by_node),
    )
    for kind, names_and_types in actions:
        for name, types in names_and_types(node, node.get_name(), node.get_namespace()):
            yield kind, name, ", ".join(types), ""


def ours(rows: Iterable[tuple[str, str, str, str]], name: str) -> list[tuple[str, str, str, str]]:
    """Leave out what every node has, and give names without the node's own."""
    found = {(kind, topic.removeprefix(f"/{name}"), *rest) for kind, topic, *rest in rows}
    return sorted(row for row in found if not row[1].rpartition("/")[2].startswith(OF_EVERY_NODE))


def interfaces_page(nodes: Sequence[tuple[NodeSpec, Node]]) -> str:
    """Return the page of topics, services and actions."""
    text = (
        "# Interfaces\n\nGenerated from the nodes by `docs/generate_reference.py`: "
        "names, types and qualities of service with the default parameters.\n"
    )
    for spec, node in nodes:
        rows = [
            (kind, f"`{name}`", f"`{kind_of}`", qos) for kind, name, kind_of, qos in ours(connections(node), spec.name)
        ]
        text += f"\n## {spec.name}\n\n{table(('', 'name', 'type', 'QoS'), rows)}"
    text += "\n## Messages, services and actions of our own\n\n"
    files = sorted(path for group in ("msg", "srv", "action") for path in (INTERFACES / group).iterdir())
    rows = [(f"`uncom_interfaces/{path.parent.name}/{path.stem}`", first_comment(path)) for path in files]
    return text + table(("type", "what"), rows) + "\nThe files in `uncom_interfaces/` say what each field means.\n"


def first_comment(path: Path) -> str:
    """Return the comment lines that a definition begins with."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines)


def parameters_page(nodes: Sequence[tuple[NodeSpec, Node]]) -> str:
    """Return the page of parameters."""
    text = (
        "# Parameters\n\nGenerated from the configuration classes by `docs/generate_reference.py`. "
        "A node reads them once, when it starts.\n"
    )
    for spec, node in nodes:
        config = node.config
        rows = [
            (
                f"`{item.name}`",
                kind_name(item),
                f"`{default_of(item)!r}`",
                usable_values(item),
                item.metadata.get("description", ""),
            )
            for item in dataclasses.fields(config)
        ]
        text += f"\n## {spec.name}\n\n{table(('name', 'type', 'default', 'range', 'meaning'), rows)}"
    return text


def kind_name(item: dataclasses.Field[Any]) -> str:
    """Return the type of a field as it is written."""
    return str(item.type).replace("tuple[str, ...]", "string[]").replace("str", "string").replace("stringing", "string")


def default_of(item: dataclasses.Field[Any]) -> Any:
    """Return the default of a field."""
    return item.default_factory() if item.default_factory is not dataclasses.MISSING else item.default


def tunables_page() -> str:
    """Return the page of numbers that tune."""
    text = (
        "# Tunables\n\nGenerated from the option classes by `docs/generate_reference.py`; "
        "`uncom tunables` prints the same.\n"
    )
    for package in PACKAGES:
        found = list(find_tunables(package))
        if found:
            text += f"\n## {package}\n"
        for group in dict.fromkeys(item.group for item in found):
            rows = [tunable_row(item) for item in found if item.group == group]
            head = ("name", "value", "unit", "meaning", "source")
            text += f"\n### {group.removeprefix(package + '.')}\n\n{table(head, rows)}"
    return text


def tunable_row(item: Tunable) -> tuple[str, ...]:
    """Return a tunable as a row."""
    value = f"{item.value:.6g}" if isinstance(item.value, float) else str(item.value)
    return f"`{item.name}`", value, item.unit, item.meaning, item.source


def make_node(spec: NodeSpec) -> Node:
    """Make a node with its shipped parameters."""
    cls = getattr(importlib.import_module(spec.module), spec.class_name)
    return cls()


def main() -> int:
    """Write the pages, or compare them."""
    parser = argparse.ArgumentParser(description="write the reference pages of the documentation from the code")
    parser.add_argument("--check", action="store_true", help="compare only")
    options = parser.parse_args()
    rclpy.init()
    try:
        nodes = [(spec, make_node(spec)) for spec in SIX_NODES]
        pages = {
            "interfaces.md": interfaces_page(nodes),
            "parameters.md": parameters_page(nodes),
            "tunables.md": tunables_page(),
        }
        for _, node in nodes:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()
    stale = [name for name, text in pages.items() if not same(REFERENCE / name, text)]
    if options.check:
        sys.stderr.write("".join(f"docs/reference/{name} is not what the code says\n" for name in stale))
        return 1 if stale else 0
    REFERENCE.mkdir(exist_ok=True)
    for name in stale:
        (REFERENCE / name).write_text(pages[name], encoding="utf-8")
    return 0


def same(path: Path, text: str) -> bool:
    """Tell whether a file holds a text."""
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    raise SystemExit(main())
