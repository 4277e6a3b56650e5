# SPDX-License-Identifier: Apache-2.0
"""The structure of the packages keeps its limits: rooms in order, small folders, files and functions, few constants."""

from __future__ import annotations

import pytest
import yaml
from architecture import PACKAGES, ROOT, import_graph
from measure_structure import (
    MAX_CONSTANTS_PER_1000_LINES,
    MAX_LONG_FUNCTIONS,
    MAX_MODULES_IN_FOLDER,
    circles,
    measure,
)

ROOMS: dict[str, list[str]] = yaml.safe_load((ROOT / "test" / "rooms.yaml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def figures():
    return {package: measure(package) for package in PACKAGES}


def room_of(module: str, rooms: list[str]) -> str:
    """Return the declared room that a module lies in: the longest name that it begins with."""
    package, _, inside = module.partition(".")
    fitting = [room for room in rooms if inside == room or inside.startswith(f"{room}.")]
    assert fitting or not inside, f"{module} lies in no room of {package} that test/rooms.yaml declares"
    return max(fitting, key=len) if fitting else ""


@pytest.mark.parametrize("package", PACKAGES)
def test_rooms_import_only_rooms_that_are_declared_before_them(package):
    rooms = ROOMS[package]
    upwards = [
        f"{module} imports {other}"
        for module, others in import_graph(package).items()
        for other in others
        if (here := room_of(module, rooms))
        and (there := room_of(other, rooms))
        and rooms.index(there) > rooms.index(here)
    ]
    assert not upwards


@pytest.mark.parametrize("package", PACKAGES)
def test_every_declared_room_is_there(package):
    folder = PACKAGES[package]
    missing = [
        room
        for room in ROOMS[package]
        if not (folder / room.replace(".", "/")).is_dir() and not (folder / f"{room.replace('.', '/')}.py").is_file()
    ]
    assert not missing


@pytest.mark.parametrize("package", PACKAGES)
def test_no_modules_import_each_other_in_a_circle(package):
    assert not circles(package)


def test_no_folder_holds_more_modules_than_one_can_survey(figures):
    crowded = {
        f"{package}/{folder}: {count}"
        for package, found in figures.items()
        for folder, count in found.folders.items()
        if count > MAX_MODULES_IN_FOLDER
    }
    assert not crowded


@pytest.mark.parametrize("package", PACKAGES)
def test_numbers_that_tune_are_options_and_not_constants(package, figures):
    assert figures[package].constants_per_1000 <= MAX_CONSTANTS_PER_1000_LINES, figures[package].constants


def test_functions_and_files_stay_short(figures):
    long = [place for found in figures.values() for place in found.long_functions]
    assert len(long) <= MAX_LONG_FUNCTIONS, long
    assert not [place for found in figures.values() for place in found.long_files]


def test_everything_public_is_documented(figures):
    assert not [place for found in figures.values() for place in found.undocumented]
