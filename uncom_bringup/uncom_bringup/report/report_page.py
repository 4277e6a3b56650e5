# SPDX-License-Identifier: Apache-2.0
"""report.html: one self-contained page that tells how a command was understood and what came of it."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import (
    ACT_COMMAND,
    ACT_NAMES,
    PRIMITIVE_NAMES,
    STATUS_NAMES,
    Event,
    Frame,
    RunRecord,
    name_of,
)
from uncom_bringup.report import execution_tree, progress, summary, table_map, timeline
from uncom_bringup.report.options import PAGE

_TEMPLATE = "report.html.j2"
_ROLES = {
    "group": "group",
    "object": "object",
    "target": "target",
    "reference": "thing that the place is beside",
    "second": "other thing that the place is between",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended: in a word, in words, and measured by whom it may concern."""

    success: bool | None
    words: str
    measured: Mapping[str, Any] = field(default_factory=dict)


def write_report(
    path: Path,
    title: str,
    record: RunRecord,
    outcome: Outcome,
    timings_s: Mapping[str, float],
    files: Sequence[str] = (),
) -> None:
    """Write the page."""
    environment = Environment(
        loader=PackageLoader("uncom_bringup"), autoescape=select_autoescape(("html", "j2")), undefined=StrictUndefined
    )
    page = environment.get_template(_TEMPLATE).render(
        title=title,
        heard=summary.heard(record),
        outcome=outcome,
        utterances=[_utterance(event, record) for event in record.of(run_record.TRANSCRIPT)],
        decisions=[_decision(event, record) for event in record.of(run_record.COMMAND)],
        stages=_stages(record),
        trees=_trees(record),
        timings=timings_s,
        backends=summary.backends(record),
        files=files,
    )
    path.write_text(page, encoding="utf-8")


def _data_uri(frame: Frame) -> str:
    return "data:image/jpeg;base64," + base64.b64encode(frame.jpeg).decode("ascii")


def _utterance(event: Event, record: RunRecord) -> dict[str, Any]:
    explanation = record.explanation_of(event.data["utterance_id"], 0) or {}
    return {
        "text": event.data["text"],
        "backend": event.data["backend"],
        "timeline": timeline.draw(event.data["words"], record.of(run_record.HANDS), explanation),
        "alternatives": [(one["text"], one["score"]) for one in event.data["alternatives"]],
    }


def _decision(event: Event, record: RunRecord) -> dict[str, Any]:
    command = event.data
    grounded = _grounded_of(record, command)
    explanation = record.explanation_of(command["utterance_id"], command["index"]) or {}
    act = name_of(ACT_NAMES, command["act"])
    picture = _picture(record, grounded)
    return {
        "caption": progress.caption(command) if command["act"] == ACT_COMMAND else command["text"],
        "act": act,
        "is_command": command["act"] == ACT_COMMAND,
        "parse_reason": command["reason"],
        "primitive": name_of(PRIMITIVE_NAMES, command["primitive"]),
        "relation": command["relation"],
        "status": name_of(STATUS_NAMES, grounded.data["status"]) if grounded is not None else "",
        "reason": grounded.data["reason"] if grounded is not None else "",
        "picture": _data_uri(picture) if picture is not None else "",
        "tables": _tables(explanation),
        "map": table_map.draw(explanation, grounded.data) if grounded is not None else "",
        "readings": explanation.get("readings") or [],
        "refused": explanation.get("refused") or [],
        "notes": explanation.get("notes") or [],
        "without": _without(explanation),
    }


def _grounded_of(record: RunRecord, command: Mapping[str, Any]) -> Event | None:
    key = (command["utterance_id"], command["index"])
    found = [e for e in record.of(run_record.GROUNDED) if (e.data["utterance_id"], e.data["index"]) == key]
    return found[-1] if found else None


def _picture(record: RunRecord, grounded: Event | None) -> Frame | None:
    """Return the annotated picture of a decision: the one that was received nearest to it."""
    if grounded is None or not record.annotated:
        return None
    return min(record.annotated, key=lambda frame: abs(frame.wall_s - grounded.wall_s))


def _tables(explanation: Mapping[str, Any]) -> list[dict[str, Any]]:
    tables = []
    for role, title in _ROLES.items():
        part = explanation.get(role) or {}
        if isinstance(part, list):  # what the objects of a group were chosen from
            part = {"candidates": part}
        candidates = sorted(part.get("candidates") or (), key=lambda c: -c["probability"])
        if not candidates:
            continue
        shown = [c for n, c in enumerate(candidates) if n < PAGE.max_candidates or c["chosen"] or c["id"] == "none"]
        names = list(dict.fromkeys(name for c in shown for name in c["factors"]))
        rows = [
            {
                "id": c["id"],
                "label": c["label"],
                "chosen": c["chosen"],
                "probability": c["probability"],
                "log": c["log"],
                "factors": [_factor(c["factors"].get(name)) for name in names],
            }
            for c in shown
        ]
        tables.append(
            {
                "role": title,
                "rule": part.get("rule") or "",
                "names": names,
                "rows": rows,
                "left_out": len(candidates) - len(shown),
            }
        )
    return tables


def _factor(value: float | None) -> tuple[float, float] | None:
    """Return a log factor and how strongly it speaks against a candidate, 0 to 1, for the colour of its cell."""
    if value is None:
        return None
    return value, 0.0 if value >= 0.0 else 1.0 - math.exp(value / 4.0)


def _without(explanation: Mapping[str, Any]) -> list[str]:
    return [
        f"without the {what}, the likeliest {part} would have been {found['likeliest']} (p={found['probability']:.2f})"
        for what, parts in (explanation.get("without") or {}).items()
        for part, found in parts.items()
    ]


def _stages(record: RunRecord) -> list[dict[str, Any]]:
    times = summary.stage_times(record)
    events = [event for event in record.of(run_record.EXECUTION) if event.data["stage"] != run_record.STAGE_IDLE]
    longest = max((seconds for _, seconds in times), default=1.0) or 1.0
    rows = []
    for number, event in enumerate(events):
        seconds = times[number][1] if number < len(times) else None
        rows.append(
            {
                "name": str(event.data["stage_name"] or event.data["stage"]).lower().replace("_", " "),
                "arm": event.data["arm"],
                "detail": event.data["detail"],
                "seconds": seconds,
                "share": 0.0 if seconds is None else seconds / longest,
                "data": _flat(event.data["data_json"]),
            }
        )
    return rows


def _flat(text: str) -> list[tuple[str, str]]:
    """Return the numbers that a stage published, as short texts; long lists (paths) only by their length."""
    data = execution_tree.data_of(text)
    return [(str(key), _short(value)) for key, value in data.items() if key != execution_tree.KEY]


def _trees(record: RunRecord) -> list[list[execution_tree.Row]]:
    """Return the behaviour trees that ran, one a command that was carried out."""
    trees = (
        execution_tree.rows_of(execution_tree.data_of(e.data["data_json"])) for e in record.of(run_record.EXECUTION)
    )
    return [rows for rows in trees if rows]


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list) and len(value) > PAGE.max_list_values:
        return f"{len(value)} values"
    written = json.dumps(value) if isinstance(value, (list, dict)) else str(value)
    most = PAGE.max_value_chars
    return written if len(written) <= most else written[: most - 3] + "..."
