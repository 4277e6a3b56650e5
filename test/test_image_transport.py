# SPDX-License-Identifier: Apache-2.0
"""Messages between processes have room for images: without, sound waits for seconds behind images sent again."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
import rclpy
from rclpy.context import Context

SEGMENT_BYTES = 32 * 1024 * 1024
MAPPING = re.compile(r"^(\w+)-(\w+) .* (/dev/shm/fastrtps_[0-9a-f]+)$", re.MULTILINE)


@pytest.mark.skipif(os.environ.get("RMW_IMPLEMENTATION") != "rmw_fastrtps_cpp", reason="another middleware")
def test_a_node_shares_memory_for_many_images(domain):
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    try:
        node = rclpy.create_node("sharing", context=context)
        maps = MAPPING.findall(Path("/proc/self/maps").read_text())
        node.destroy_node()
    finally:
        context.try_shutdown()
    assert max(int(end, 16) - int(start, 16) for start, end, _ in maps) >= SEGMENT_BYTES
