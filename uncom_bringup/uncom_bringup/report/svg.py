# SPDX-License-Identifier: Apache-2.0
"""A few SVG elements as strings; every text and attribute is escaped here and nowhere else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from markupsafe import Markup


def element(name: str, body: str = "", **attributes: object) -> str:
    """Write one element; `stroke_width=2` becomes `stroke-width="2"`, `cls` becomes `class`; None leaves one out."""
    text = "".join(
        f' {("class" if key == "cls" else key.replace("_", "-"))}="{escape(_value(value), quote=True)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{text}>{body}</{name}>" if body else f"<{name}{text}/>"


def _value(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def text(content: str, x: float, y: float, cls: str = "", anchor: str = "start") -> str:
    """Write a text whose baseline starts (or ends, or is centred) at a point."""
    return element("text", escape(content), x=x, y=y, cls=cls or None, text_anchor=anchor)


def line(x1: float, y1: float, x2: float, y2: float, cls: str) -> str:
    """Write a line."""
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, cls=cls)


def polygon(points: Iterable[Sequence[float]], cls: str, title: str = "") -> str:
    """Write a closed outline, with a tooltip if a title is given."""
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return element("polygon", element("title", escape(title)) if title else "", points=path, cls=cls)


def rectangle(x: float, y: float, width: float, height: float, cls: str, title: str = "") -> str:
    """Write a rectangle with slightly round corners."""
    body = element("title", escape(title)) if title else ""
    return element("rect", body, x=x, y=y, width=max(0.0, width), height=height, rx=3, cls=cls)


def drawing(width: float, height: float, parts: Iterable[str], label: str) -> Markup:
    """Put elements into one drawing that scales with the page; `label` is for who cannot see it."""
    body = "".join(parts)
    head = f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label, quote=True)}"'
    # Every piece above was escaped where it was made.
    return Markup(f'{head} xmlns="http://www.w3.org/2000/svg">{body}</svg>')  # noqa: S704
