# SPDX-License-Identifier: Apache-2.0
"""One line of words for each event that a person wants to hear of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import (
    ACT_COMMAND,
    ACT_NAMES,
    PRIMITIVE_NAMES,
    STATUS_GROUNDED,
    STATUS_NAMES,
    TARGET_AREA,
    TARGET_OBJECT,
    Event,
    name_of,
)

HEAD_WIDTH = 14


def line(event: Event) -> str | None:
    """Return the line for an event, or None if nobody needs to hear of it."""
    make = _MAKERS.get(event.kind)
    text = make(event.data) if make else None
    if text is None:
        return None
    return head(*text.split("|", 1))


def head(name: str, words: str) -> str:
    """Put a name before words, all names equally wide."""
    return f"{name:<{HEAD_WIDTH - 1}} {words}"


def _transcript(data: Mapping[str, Any]) -> str:
    return f'heard|"{data["text"]}"'


def _command(data: Mapping[str, Any]) -> str:
    if data["act"] != ACT_COMMAND:
        act = name_of(ACT_NAMES, data["act"])
        return f"understood|{act}" + (f": {data['reason']}" if data["reason"] else "")
    return f"understood|{caption(data)}"


def caption(command: Mapping[str, Any]) -> str:
    """Write a command as the paper's figures do: object - action - target."""
    target = _words(command["target"])
    relation = str(command["relation"]).replace("_", " ")
    if relation and relation not in ("none", "here", "there") and not target.startswith(relation):
        target = f"{relation} {target}"
    if command["reference2"]["present"]:
        target += f" and {_words(command['reference2'])}"
    action = command["action_text"] or name_of(PRIMITIVE_NAMES, command["primitive"])
    return " - ".join((_words(command["object"]), str(action), target))


def _words(reference: Mapping[str, Any]) -> str:
    return str(reference["text"]) if reference["present"] else "(nothing)"


def _grounded(data: Mapping[str, Any]) -> str:
    if data["status"] != STATUS_GROUNDED:
        return f"chosen|{name_of(STATUS_NAMES, data['status'])}: {data['reason']}"
    thing = data["object"]
    parts = [f"{thing['label'] or data['object_text']} {_where(thing)}, p={data['object_probability']:.2f}"]
    target = data["target"]
    if target["kind"] == TARGET_OBJECT:
        where = target["object"]
        name = where["label"] or data["target_text"]
        parts.append(f"{name} {_where(where)}, p={data['target_probability']:.2f}")
    elif target["kind"] == TARGET_AREA:
        parts.append(f"free place {_place(target['pose']['position'])}, p={data['target_probability']:.2f}")
    return "chosen|" + "  ->  ".join(parts)


def _where(thing: Mapping[str, Any]) -> str:
    if thing["has_geometry"]:
        return _place(thing["centroid"])
    u, v = (0.5 * (thing[f"{axis}_min"] + thing[f"{axis}_max"]) for axis in "xy")
    return f"at pixel ({u:.0f}, {v:.0f})"


def _place(point: Mapping[str, Any]) -> str:
    return f"at ({point['x']:.2f}, {point['y']:+.2f}) m"


def _execution(data: Mapping[str, Any]) -> str | None:
    if data["stage"] == run_record.STAGE_IDLE:
        return None
    name = str(data["stage_name"] or data["stage"]).lower().replace("_", " ")
    arm = f"{data['arm']} arm" if data["arm"] else ""
    return f"{name}|" + ", ".join(part for part in (arm, data["detail"]) if part)


def _say(data: Mapping[str, Any]) -> str:
    return f"robot says|{data['data']}"


def _question(data: Mapping[str, Any]) -> str:
    return f"robot asks|{data['text']}"


_MAKERS = {
    run_record.TRANSCRIPT: _transcript,
    run_record.COMMAND: _command,
    run_record.GROUNDED: _grounded,
    run_record.EXECUTION: _execution,
    run_record.SAY: _say,
    run_record.QUESTION: _question,
}
