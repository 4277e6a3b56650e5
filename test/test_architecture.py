# SPDX-License-Identifier: Apache-2.0
"""The rules between packages hold in every source file; those within a file are the linter's (pyproject.toml)."""

from __future__ import annotations

import re
from collections import Counter

from architecture import PACKAGES, ROOT, modules

ALL = list(modules())
BELOW = {  # what a package may import of ours
    "uncom_common": set(),
    "uncom_language": {"uncom_common"},
    "uncom_perception": {"uncom_common"},
    "uncom_reasoner": {"uncom_common", "uncom_language", "uncom_perception"},
    "uncom_tiago_exec": {"uncom_common", "uncom_perception"},
    "uncom_bringup": {"uncom_common", "uncom_language", "uncom_perception", "uncom_reasoner", "uncom_sim"},
    # Its benchmarks measure the others.
    "uncom_sim": set(PACKAGES) - {"uncom_sim"},
}
# Node files that others import: the base of all nodes, and bringup's own listeners, for the demo.
SHARED_NODES = ("uncom_common.configured_node",)
SHARED_WITH_SIMULATOR = ("uncom_bringup.monitor.monitor_node", "uncom_bringup.replay.recorder_node")


def test_there_is_source_of_every_package():
    assert {module.package for module in ALL} == set(PACKAGES)


def test_packages_import_only_what_lies_below_them():
    wrong = {
        module.name: above
        for module in ALL
        if (above := _packages_of(module) - BELOW[module.package] - {module.package})
    }
    assert not wrong


def test_no_package_imports_another_ones_node():
    wrong = {}
    for module in ALL:
        shared = SHARED_NODES + (SHARED_WITH_SIMULATOR if module.package == "uncom_sim" else ())
        others = {name for name in module.imports if name.partition(".")[0] in set(PACKAGES) - {module.package}}
        nodes = {name for name in others if re.search(r"_node(\.[A-Za-z]\w*)?$", name)}
        if foreign := {name for name in nodes if not name.startswith(shared)}:
            wrong[module.name] = foreign
    assert not wrong


def test_a_file_is_called_a_node_where_it_defines_one():
    """The linter goes by the name: only such files, ros/ folders, conversions and launch files may know ROS."""
    named = {module.name for module in ALL if module.path.name.endswith("_node.py")}
    assert named == {module.name for module in ALL if module.defines_node}


def test_only_the_demo_and_the_benchmarks_reach_for_the_simulator():
    commands = "uncom_bringup/uncom_bringup/commands"
    reaching = {module.name for module in ALL if module.package == "uncom_bringup" and module.imports_any("uncom_sim")}
    assert {name for name in reaching if not name.startswith(f"{commands}/bench")} <= {f"{commands}/demo.py"}


def test_every_file_says_its_licence_first():
    first_lines = {module.name: module.path.read_text(encoding="utf-8").splitlines()[:2] for module in ALL}
    licence = "# SPDX-License-Identifier: Apache-2.0"
    assert not [name for name, lines in first_lines.items() if lines and licence not in lines]


def test_a_package_root_imports_nothing():
    """Importing a value type must not pull in a recogniser."""
    roots = {folder / "__init__.py" for folder in PACKAGES.values()}
    assert not {module.name: module.imports for module in ALL if module.path in roots and module.imports}


def test_tests_lie_in_files_of_unique_names():
    """The root run of pytest needs it."""
    paths = [*ROOT.glob("*/test/**/test_*.py"), *ROOT.glob("test/test_*.py")]
    assert not [name for name, count in Counter(path.name for path in paths).items() if count > 1]


def _packages_of(module):
    return {name.partition(".")[0] for name in module.imports} & set(PACKAGES)
