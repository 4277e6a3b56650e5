# SPDX-License-Identifier: Apache-2.0
"""Every example runs to its end and prints what it shows."""

from __future__ import annotations

import runpy
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

from uncom_interfaces.msg import GroundedCommand

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("[0-9]*.py"))
SPIN_FOREVER = {"07_own_node.py"}


@pytest.mark.parametrize("path", [p for p in EXAMPLES if p.name not in SPIN_FOREVER], ids=lambda path: path.name)
def test_an_example_runs_and_prints_something(path):
    done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip()


def test_examples_are_numbered_without_gaps():
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))


def test_the_node_of_ones_own_announces_what_was_understood(domain):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    executor = SingleThreadedExecutor(context=context)
    try:
        node = runpy.run_path(str(EXAMPLES[0].with_name("07_own_node.py")))["AnnouncerNode"](context=context)
        probe, heard = Node("probe", context=context), []
        probe.create_subscription(String, "/uncom/say", lambda message: heard.append(message.data), 10)
        commands = probe.create_publisher(GroundedCommand, "/uncom/grounded_command", 10)
        for each in (node, probe):
            executor.add_node(each)
        deadline = time.monotonic() + 60.0
        while not (commands.get_subscription_count() and probe.count_publishers("/uncom/say")):
            executor.spin_once(timeout_sec=0.1)
            assert time.monotonic() < deadline
        commands.publish(GroundedCommand(object_text="lemon", target_text="bowl", relation="in"))
        while not heard and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        assert heard == ["Attention: I am going to move the lemon in the bowl."]
    finally:
        executor.shutdown()
        rclpy.try_shutdown(context=context)
