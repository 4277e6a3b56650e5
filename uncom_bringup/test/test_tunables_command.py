# SPDX-License-Identifier: Apache-2.0
"""`uncom tunables` prints what the option classes declare, and loads nothing else for it."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys

import pytest
from uncom_bringup.commands import tunables
from uncom_bringup.exceptions import BadInputError
from uncom_common.tunables import Tunable

HEAVY = ("rclpy", "cv2", "mediapipe", "pybullet", "pinocchio", "torch")


def test_every_tunable_says_what_it_means():
    found = tunables.select_tunables("")
    assert {item.group.split(".")[0] for item in found} >= {"uncom_language", "uncom_reasoner"}
    assert all(item.meaning for item in found)
    assert len({(item.group, item.name) for item in found}) == len(found)


def test_a_package_a_folder_and_a_class_select_theirs():
    language = tunables.select_tunables("uncom_language")
    assert language
    assert {item.group.split(".")[0] for item in language} == {"uncom_language"}
    group = language[0].group
    whole = [item for item in language if item.group == group]
    assert tunables.select_tunables(group) == whole
    assert tunables.select_tunables(group.rpartition(".")[2]) == whole
    assert set(whole) <= set(tunables.select_tunables(group.rpartition(".")[0]))


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(BadInputError, match=r"'speeches'.*uncom_language"):
        tunables.select_tunables("speeches")


def test_a_line_holds_value_unit_meaning_and_source():
    item = Tunable("pkg.options.PlaceOptions", "gap_m", 0.02, "m", "least gap", "REP 105")
    assert tunables.table_lines([item])[0] == "pkg.options.PlaceOptions"
    line = tunables.table_lines([item])[1]
    assert line.split()[:3] == ["gap_m", "0.02", "m"]
    assert line.endswith("least gap [REP 105]")


def test_json_is_one_object_and_values_are_those_of_the_classes(capsys):
    assert tunables.run(argparse.Namespace(group="uncom_language", json=True)) == 0
    printed = json.loads(capsys.readouterr().out)["tunables"]
    found = tunables.select_tunables("uncom_language")
    assert [(entry["group"], entry["name"]) for entry in printed] == [(item.group, item.name) for item in found]


def test_only_the_option_modules_are_loaded():
    code = (
        "import sys; from uncom_bringup.commands import tunables; "
        "[list(tunables.find_tunables(p)) for p in tunables.ROBOT_PACKAGES]; "
        f"print(sorted(set({HEAVY!r}) & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"
