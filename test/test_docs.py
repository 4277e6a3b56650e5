# SPDX-License-Identifier: Apache-2.0
"""The documentation is what the code says: reference pages, picture of the rooms, links and glossary."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from architecture import ROOT


def run(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *command],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )


def test_the_reference_pages_are_what_the_nodes_offer(domain):
    done = run("docs/generate_reference.py", "--check", ROS_DOMAIN_ID=str(domain))
    assert done.returncode == 0, done.stderr[-2000:]


def test_the_picture_of_the_rooms_is_drawn_from_their_declared_order():
    done = run("docs/draw_rooms.py", "--check")
    assert done.returncode == 0, done.stderr


PAGES = [page for page in sorted(ROOT.glob("docs/**/*.md")) if not {"api", "_build"} & set(page.parts)]


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES], ids=lambda page: page.name)
def test_files_that_a_page_names_are_there(page):
    """A path in code spelling that begins with one of our folders and ends in a suffix or a slash must exist."""
    roots = tuple(f"{entry.name}/" for entry in ROOT.iterdir() if entry.is_dir() and not entry.name.startswith("."))
    named = [word for line in page.read_text(encoding="utf-8").split("`")[1::2] for word in line.split()]
    paths = [word for word in named if word.startswith(roots) and (word.endswith("/") or Path(word).suffix)]
    assert not [path for path in paths if not set(path) & set("*<>{}()[]") and not (ROOT / path).exists()]
