# SPDX-License-Identifier: Apache-2.0
"""The sample bags still give what their manifest expects, the same in every run and at every rate."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.report.compare import compare
from uncom_bringup.report.reproducible_result import reproducible_result
from uncom_bringup.ros.understand_recording import check_bag, understand, understand_in_process

BAGS = Path(__file__).resolve().parents[1] / "bags"
MANIFEST = yaml.safe_load((BAGS / "manifest.yaml").read_text(encoding="utf-8"))
pytestmark = pytest.mark.timeout(400)


def path_of(name):
    return BAGS / f"{name}.mcap"


def test_the_manifest_names_every_bag_and_they_are_small():
    assert {path.stem for path in BAGS.glob("*.mcap")} == set(MANIFEST["bags"])
    assert sum(path.stat().st_size for path in BAGS.glob("*.mcap")) < 15e6


@pytest.mark.parametrize("name", MANIFEST["bags"])
def test_a_bag_holds_the_topics_of_the_manifest_in_under_600_kb_a_second(name):
    with BagReader(path_of(name)) as bag:
        assert [topic.name for topic in bag.topics] == sorted(MANIFEST["topics"])
        # Twice the usual noise of the camera takes more room.
        assert path_of(name).stat().st_size < (900e3 if name == "this_here" else 600e3) * bag.duration_s


def near(found, wanted, tolerance):
    return found is not None and math.dist(found[:2], wanted) <= tolerance


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow]) for n in MANIFEST["bags"]])
def test_a_bag_still_gives_what_is_expected(name):
    expected = MANIFEST["bags"][name]["expected"]
    seen = understand_in_process(path_of(name))
    found = seen.reproducible_result()
    assert found["examined"] == found["pictures"] > 0
    assert found["heard"] == expected["heard"]
    last = found["commands"][-1]
    decision = last["decisions"][-1]
    assert decision["status"] == expected["status"], decision["reason"]
    assert expected.get("reason", "") in decision["reason"]
    assert last["relation"] == expected.get("relation", "none")
    tolerance = MANIFEST["tolerance_m"]
    for part, most in (("object", tolerance), ("target", tolerance), ("area", expected.get("area_tolerance_m", 0.0))):
        if part in expected:
            assert near(decision["chosen"][part], expected[part], most), (part, decision["chosen"])
        else:
            assert decision["chosen"][part] is None


def test_two_runs_at_two_rates_give_the_same_answer_digit_for_digit(tmp_path, domain, monkeypatch):
    """Once by nodes in one process as fast as they can, once by processes held to the pace of the recording."""
    fast = understand_in_process(path_of("named_things"))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    with BagReader(path_of("named_things")) as bag:
        check_bag(bag)
        slow = understand(bag, tmp_path / "log", rate=1.0)
    assert fast.reproducible_result() == slow.reproducible_result()
    assert compare(fast.reproducible_result(), slow.reproducible_result()) == []
    assert reproducible_result(fast.record)["commands"]
    assert fast.examined == fast.pictures
