# SPDX-License-Identifier: Apache-2.0
"""Repair the CMake exports of the ROS wheels: they name include folders of the machine that built them.

Rewrites those folders to the ones of this environment. Safe to run again.
"""

import pathlib
import re
import sys
import sysconfig

import numpy as np

PYTHON_INCLUDE = re.compile(r"/opt/python/[^;\"\s]*?/include/python3\.\d+")
NUMPY_INCLUDE = re.compile(r"/opt/python/[^;\"\s]*?/site-packages/numpy/(?:_core|core)/include")


def main() -> None:
    """Rewrite every export below the environment's share folder and say how many changed."""
    share = pathlib.Path(sys.prefix) / "share"
    changed = 0
    for export in share.rglob("*.cmake"):
        before = export.read_text(encoding="utf-8")
        after = NUMPY_INCLUDE.sub(np.get_include(), before)
        after = PYTHON_INCLUDE.sub(sysconfig.get_paths()["include"], after)
        if after != before:
            # The installer links files into its cache: replace this one, never write through the link.
            export.unlink()
            export.write_text(after, encoding="utf-8")
            changed += 1
    sys.stderr.write(f"uncom: {changed} CMake exports repaired\n")


if __name__ == "__main__":
    main()
