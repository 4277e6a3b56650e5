# SPDX-License-Identifier: Apache-2.0
"""package.xml, setup.py, the robot's requirements and the README declare what the code imports; versions agree."""

from __future__ import annotations

import re
import tomllib
from importlib import metadata
from xml.etree import ElementTree as ET

import pytest
from architecture import PACKAGES, ROOT
from packaging_rules import declared, needed

ROBOT = [name for name in PACKAGES if name != "uncom_sim"]
MANIFESTS = sorted([*ROOT.glob("uncom_*/package.xml"), ROOT / "sim" / "package.xml"])
LOCK = (ROOT / "requirements" / "dev.lock").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
NOTHING = {"missing": set(), "unused": set()}
# Its own requirements do not fit what the others need: it is installed without them.
ALONE = "mediapipe"


def requirements(text: str) -> set[str]:
    """Return the names of a requirements file."""
    lines = (line.partition("#")[0].strip() for line in text.splitlines())
    return {re.split(r"[<>=!~;\[ ]", line, maxsplit=1)[0].lower() for line in lines if line and line[0] != "-"}


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_declares_what_it_imports_and_nothing_else(package):
    says, needs = declared(package), needed(package)
    for field in ("package_xml", "test_depend", "install_requires"):
        wanted, found = getattr(needs, field), getattr(says, field)
        assert {"missing": wanted - found, "unused": found - wanted} == NOTHING, field
    assert says.extras_require == needs.extras_require


@pytest.mark.parametrize("package", ROBOT)
def test_unit_tests_of_a_package_on_the_robot_need_no_simulator(package):
    for names in (needed(package).test_depend, needed(package).package_xml):
        assert not names & {"uncom_sim", "python3-pybullet-pip"}


def test_robot_requirements_are_those_of_the_packages_on_it():
    listed = requirements((ROOT / "requirements" / "robot.txt").read_text(encoding="utf-8"))
    wanted = {name for package in ROBOT for name in declared(package).install_requires} - {"setuptools", ALONE}
    of_mediapipe = {re.split(r"[<>=!~;\[ ]", need, maxsplit=1)[0] for need in metadata.requires(ALONE) or ()}
    assert wanted <= listed
    assert listed - wanted <= of_mediapipe | {"example-robot-data"}


def test_readme_installs_the_same_mediapipe_as_the_environment():
    pin = next(line for line in _project()["dependencies"] if line.startswith(f"{ALONE}=="))
    assert f"pip install --no-deps {pin}" in README
    assert "requirements/robot.txt" in README


def test_the_environment_holds_what_the_packages_need():
    locked = {line.partition("==")[0] for line in LOCK.splitlines()}
    wanted = {name for package in PACKAGES for name in declared(package).install_requires} - {"setuptools"}
    assert {name.replace(".", "-") for name in wanted} <= locked


def test_one_version_stands_everywhere():
    versions = {str(path.relative_to(ROOT)): ET.parse(path).getroot().findtext("version") for path in MANIFESTS}
    versions["pyproject.toml"] = _project()["version"]
    assert set(versions.values()) == {_project()["version"]}, versions


def _project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
