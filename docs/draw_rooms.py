# SPDX-License-Identifier: Apache-2.0
"""Draw docs/rooms.svg from test/rooms.yaml: `./uncom exec python docs/draw_rooms.py [--check]`.

Each package is a column of its rooms, lowest at the bottom: a room imports only what lies below it, and a package only
packages to its left.
"""

from __future__ import annotations

import argparse
import sys
from html import escape
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "rooms.svg"
WIDTH, ROW, GAP, TOP = 205, 24, 14, 60  # [px]
RULE = (
    "A room imports only rooms below it, a package only packages to its left; the commands of uncom_bringup "
    "start the simulator."
)
COLOURS = ("#e8eef7", "#e6f2ea", "#f6efe0", "#f4e6ea", "#ece6f4", "#e4f1f3", "#eeeeee")


def draw(rooms: dict[str, list[str]]) -> str:
    """Return the picture as SVG."""
    tallest = max(map(len, rooms.values()))
    height = TOP + tallest * ROW + 30
    width = len(rooms) * (WIDTH + GAP) + GAP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"',
        ' font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="{GAP}" y="20" fill="#555">{RULE}</text>',
    ]
    for column, (package, names) in enumerate(rooms.items()):
        left = GAP + column * (WIDTH + GAP)
        parts.append(f'<text x="{left}" y="{TOP - 12}" font-weight="bold" font-size="13">{escape(package)}</text>')
        for level, name in enumerate(reversed(names)):
            y = TOP + (tallest - len(names) + level) * ROW
            colour = COLOURS[column % len(COLOURS)]
            parts.append(
                f'<rect x="{left}" y="{y}" width="{WIDTH}" height="{ROW - 4}" rx="3" fill="{colour}" stroke="#999"/>'
            )
            parts.append(f'<text x="{left + 8}" y="{y + 14}">{escape(name)}</text>')
    return "\n".join([*parts, "</svg>\n"])


def main() -> int:
    """Write the picture, or compare it."""
    parser = argparse.ArgumentParser(description="draw the rooms of the packages")
    parser.add_argument(
        "--check", action="store_true", help="compare only; exit status 1 if the picture is out of date"
    )
    options = parser.parse_args()
    text = draw(yaml.safe_load((ROOT / "test" / "rooms.yaml").read_text(encoding="utf-8")))
    if options.check:
        current = PICTURE.exists() and PICTURE.read_text(encoding="utf-8") == text
        sys.stderr.write("" if current else "docs/rooms.svg is out of date: run docs/draw_rooms.py\n")
        return 0 if current else 1
    PICTURE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
