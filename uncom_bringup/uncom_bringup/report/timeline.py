# SPDX-License-Identifier: Apache-2.0
"""The words of an utterance on a line of time, with the hands and rays that were seen meanwhile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from uncom_bringup.monitor.run_record import Event
from uncom_bringup.report import svg
from uncom_bringup.report.options import TIMELINE

_ROWS_PX = {"hands": TIMELINE.hands_y_px, "object": TIMELINE.object_y_px, "target": TIMELINE.target_y_px}


@dataclass(frozen=True, slots=True)
class _Scale:
    """From seconds to pixels."""

    begin_s: float
    end_s: float

    def x(self, seconds: float) -> float:
        """Place of a time, clipped to the drawing."""
        share = (seconds - self.begin_s) / max(1e-6, self.end_s - self.begin_s)
        return TIMELINE.left_px + min(1.0, max(0.0, share)) * (TIMELINE.width_px - TIMELINE.left_px - TIMELINE.right_px)

    def shows(self, seconds: float) -> bool:
        """Whether a time is inside."""
        return self.begin_s <= seconds <= self.end_s


def draw(words: Sequence[Mapping[str, Any]], hands: Sequence[Event], explanation: Mapping[str, Any]) -> Markup:
    """Draw an utterance.

    Args:
        words: of the transcript ("text", "start", "end", "confidence") [s].
        hands: what was seen of hands, one event an image.
        explanation: as uncom_reasoner/explanation.py lays it out, or empty.
    """
    if not words:
        return Markup("")
    scale = _Scale(float(words[0]["start"]) - TIMELINE.before_s, float(words[-1]["end"]) + TIMELINE.after_s)
    parts = [*_axis(scale, float(words[0]["start"])), *_words(scale, words, explanation), *_hands(scale, hands)]
    for role in ("object", "target"):
        parts += _gesture(scale, role, (explanation.get("rays") or {}).get(role))
        parts += _frame(scale, role, (explanation.get("frames") or {}).get(role))
    return svg.drawing(TIMELINE.width_px, TIMELINE.height_px, parts, "words and pointing rays over time")


def _axis(scale: _Scale, zero_s: float) -> list[str]:
    parts = [
        svg.line(
            TIMELINE.left_px,
            TIMELINE.height_px - 22,
            TIMELINE.width_px - TIMELINE.right_px,
            TIMELINE.height_px - 22,
            "axis",
        )
    ]
    step = 0.5 if scale.end_s - scale.begin_s < TIMELINE.fine_ticks_below_s else 1.0
    number = round((scale.begin_s - zero_s) / step)
    while zero_s + number * step <= scale.end_s:
        moment = zero_s + number * step
        if scale.shows(moment):
            x = scale.x(moment)
            parts.append(svg.line(x, TIMELINE.height_px - 26, x, TIMELINE.height_px - 18, "axis"))
            parts.append(svg.text(f"{number * step:g} s", x, TIMELINE.height_px - 4, "tick", "middle"))
        number += 1
    return parts


def _words(scale: _Scale, words: Sequence[Mapping[str, Any]], explanation: Mapping[str, Any]) -> list[str]:
    spans = (explanation.get("command") or {}).get("spans") or {}
    parts = [svg.text("words", 4, TIMELINE.words_y_px + 5, "rowname")]
    for word in words:
        start, end = float(word["start"]), float(word["end"])
        middle = (start + end) / 2.0
        role = next((name for name, (low, high) in spans.items() if low <= middle <= high), "other")
        x, width = scale.x(start), scale.x(end) - scale.x(start)
        title = f"{word['text']}: {start:.2f} to {end:.2f} s, confidence {word['confidence']:.2f}"
        parts.append(svg.rectangle(x, TIMELINE.words_y_px - 16, width - 1, 30, f"word {role}", title))
        # Short words stand higher so that neighbours do not run into each other.
        narrow = width < 7.5 * len(word["text"]) + 4
        parts.append(
            svg.text(
                word["text"],
                x + width / 2,
                TIMELINE.words_y_px - 22 if narrow else TIMELINE.words_y_px + 4,
                "wordtext",
                "middle",
            )
        )
    return parts


def _hands(scale: _Scale, hands: Sequence[Event]) -> list[str]:
    y = _ROWS_PX["hands"]
    parts = [
        svg.text("hands seen", 4, y + 4, "rowname"),
        svg.line(TIMELINE.left_px, y, TIMELINE.width_px - TIMELINE.right_px, y, "guide"),
    ]
    for event in hands:
        if not scale.shows(event.stamp_s):
            continue
        x = scale.x(event.stamp_s)
        if event.data["pointing_hand"] >= 0:
            parts.append(svg.line(x, y - 9, x, y + 9, "pointing"))
        elif event.data["hands"]:
            parts.append(svg.line(x, y - 6, x, y + 6, "hand"))
        else:
            parts.append(svg.line(x, y - 2, x, y + 2, "nohand"))
    return parts


def _gesture(scale: _Scale, role: str, ray: Mapping[str, Any] | None) -> list[str]:
    y = _ROWS_PX[role]
    parts = [
        svg.text(f"{role} rays", 4, y + 4, "rowname"),
        svg.line(TIMELINE.left_px, y, TIMELINE.width_px - TIMELINE.right_px, y, "guide"),
    ]
    if ray is None:
        return parts
    start, end = ray["span"]
    x = scale.x(start)
    parts.append(
        svg.rectangle(x, y - 10, scale.x(end) - x, 20, f"span {role}", f"looked at from {start:.2f} to {end:.2f} s")
    )
    if not ray["present"]:
        parts.append(svg.text("no gesture", x + 4, y + 4, "tick"))
    for dwell in ray["dwells"]:
        for stamp, still in zip(dwell["stamps"], dwell["stillness"], strict=False):
            radius = 2.0 + 3.0 * max(0.0, min(1.0, still)) * dwell["share"]
            parts.append(svg.element("circle", cx=scale.x(stamp), cy=y, r=radius, cls="ray"))
    return parts


def _frame(scale: _Scale, role: str, stamp: float | None) -> list[str]:
    if not stamp or not scale.shows(stamp):
        return []
    x = scale.x(stamp)
    above = _ROWS_PX["hands"] - 22
    return [
        svg.line(x, above, x, _ROWS_PX[role] + 12, f"frame {role}"),
        svg.text(f"{role} frame", x + 3, above + (8 if role == "object" else -2), "tick"),
    ]
