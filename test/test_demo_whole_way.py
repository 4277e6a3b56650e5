# SPDX-License-Identifier: Apache-2.0
"""From sound and pixels to the physical result, through every package, as a user starts it."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.graph.topics import RECORDED, SIM_STATE

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
KEYS = {"heard", "understood", "chosen", "physical", "success", "timings_s", "backends", "artifacts"}
NEVER_SAID = {"/uncom/question", "/uncom/answer", "/uncom/stop", "/uncom/say"}


def demo(*arguments):
    command = [sys.executable, "-m", "uncom_bringup.cli", "demo", "--json", *arguments]
    result = subprocess.run(command, capture_output=True, text=True, timeout=580, check=False)
    return result.returncode, json.loads(result.stdout)


def test_a_spoken_and_pointed_command_is_carried_out(tmp_path):
    status, result = demo("--scenario", "iv", "--out", str(tmp_path / "out"))
    assert result.keys() >= KEYS
    assert result["success"], result["reason"]
    assert status == 0
    assert result["understood"]["relation"] == "in"
    assert result["chosen"] == {"object": "lemon_1", "target": "bowl_1", "area": None}
    assert result["physical"]["object_moved_m"] > 0.1
    assert set(result["backends"]) >= {"speech", "language", "hands", "detection"}
    for name in ("report.html", "command.json", "annotated_action.png", "video.mp4", "run.mcap"):
        assert (tmp_path / "out" / name).stat().st_size > 1000
    with BagReader(tmp_path / "out" / "run.mcap") as bag:
        recorded = {message.topic.name for message in bag.messages()}
    assert recorded >= {topic.stored_name for topic in RECORDED if topic.name not in NEVER_SAID}
    assert SIM_STATE.name in recorded


@pytest.mark.parametrize("words", ["hello there", "", "mmm brrr tss"])
def test_what_is_no_command_moves_nothing_and_says_why(tmp_path, words):
    status, result = demo("--say", words, "--out", str(tmp_path / "out"), "--no-video", "--no-bag")
    assert status == 1
    assert not result["success"]
    assert result["reason"]
    assert result["physical"]["object_moved_m"] == 0.0
    assert result["physical"]["others_moved_m"] < 0.005
    assert not [name for name in result["timings_s"] if name.startswith("stage_")]
