# SPDX-License-Identifier: Apache-2.0
"""`uncom test` runs the tests of the packages without the simulator."""

from __future__ import annotations

from uncom_bringup.commands.test import checks

FOLDERS = ("uncom_common", "uncom_language", "sim", "test")


def workspace(tmp_path):
    for folder in ("uncom_common/test", "uncom_language/test", "sim/test", "test"):
        (tmp_path / folder).mkdir(parents=True)
    return tmp_path


def test_only_tests_of_packages_on_the_robot_run_without_the_simulator(tmp_path):
    found = {check.name: check.without_simulator for check in checks(workspace(tmp_path), FOLDERS)}
    tests = {name: without for name, without in found.items() if name.startswith("tests of")}
    assert tests == {
        "tests of uncom_common": True,
        "tests of uncom_language": True,
        "tests of sim": False,
        "tests of test": False,
    }
