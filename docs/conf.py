# SPDX-License-Identifier: Apache-2.0
"""Sphinx settings: `./uncom exec sphinx-build -W docs OUT`; offline, the API pages are read from the sources."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

project = "UNCOM for TIAGo++"
author = "UNCOM maintainers"
copyright = "UNCOM maintainers, Apache-2.0"  # noqa: A001 (the name that Sphinx reads)
release = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)[1]

extensions = ["myst_parser", "autodoc2"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"{project} {release}"

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# The packages that others build on; command line and simulator have pages of their own. Read as text, not imported: no
# page needs ROS, a robot or a model.
autodoc2_packages = [
    {"path": f"../{folder}", "auto_mode": True}
    for folder in (
        "uncom_common/uncom_common",
        "uncom_language/uncom_language",
        "uncom_perception/uncom_perception",
        "uncom_reasoner/uncom_reasoner",
        "uncom_tiago_exec/uncom_tiago_exec",
    )
]
autodoc2_output_dir = "api"
autodoc2_hidden_objects = {"private", "inherited", "dunder", "undoc"}
autodoc2_render_plugin = "myst"
