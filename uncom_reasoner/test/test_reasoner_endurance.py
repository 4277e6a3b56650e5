# SPDX-License-Identifier: Apache-2.0
"""The node over many commands: nothing grows, and the last is answered as the first."""

from __future__ import annotations

import gc
from dataclasses import replace

import psutil
import pytest
import rclpy
from test_reasoner_node import Graph, lemon_to_bowl

from uncom_interfaces.msg import GroundedCommand

DOMAIN = 72
WARM, COMMANDS = 100, 500
MOST_GROWTH_BYTES = 12e6  # 30 kB a command: a picture or a point cloud that is kept would be many times that


@pytest.mark.slow
def test_memory_is_flat_over_five_hundred_commands():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    try:
        with Graph(context) as world:
            world.look()
            grounded, sizes = [], []
            for number in range(COMMANDS):
                world.received.clear()
                world.requests.clear()
                world.say(replace(lemon_to_bowl(world.start_s), utterance_id=f"u{number}"))
                answer = world.wait("/uncom/grounded_command")
                world.wait("/uncom/annotated")
                grounded.append((answer.utterance_id, answer.status, answer.object.id, answer.target.object.id))
                if number + 1 in (WARM, COMMANDS):
                    gc.collect()
                    sizes.append(psutil.Process().memory_info().rss)
    finally:
        rclpy.try_shutdown(context=context)
    assert grounded == [(f"u{n}", GroundedCommand.GROUNDED, "lemon_1", "bowl_1") for n in range(COMMANDS)]
    assert sizes[1] - sizes[0] < MOST_GROWTH_BYTES
