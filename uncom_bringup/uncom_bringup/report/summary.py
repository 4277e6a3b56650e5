# SPDX-License-Identifier: Apache-2.0
"""What a run came to, from what was seen of it: words, parts, choice, times, back ends; all ready for JSON."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import (
    ACT_COMMAND,
    PRIMITIVE_NAMES,
    STAGE_IDLE,
    STATUS_GROUNDED,
    TARGET_AREA,
    TARGET_OBJECT,
    Event,
    RunRecord,
    name_of,
)


def heard(record: RunRecord) -> str:
    """Return all that was heard, utterance by utterance."""
    return " ".join(event.data["text"] for event in record.of(run_record.TRANSCRIPT)).strip()


def understood(record: RunRecord) -> dict[str, Any]:
    """Return object, action, target and relation of the last command (empty words for what is missing)."""
    commands = [event.data for event in record.of(run_record.COMMAND)]
    chosen = next((data for data in reversed(commands) if data["act"] == ACT_COMMAND), None)
    if chosen is None:
        return {"object": None, "action": None, "target": None, "relation": None}
    primitive = name_of(PRIMITIVE_NAMES, chosen["primitive"])
    return {
        "object": _text(chosen["object"]),
        "action": chosen["action_text"] or primitive,
        "target": _text(chosen["target"]),
        "relation": chosen["relation"] or "none",
        "primitive": primitive,
    }


def _text(reference: Mapping[str, Any]) -> str | None:
    return str(reference["text"]) if reference["present"] else None


def chosen_places(grounded: Mapping[str, Any]) -> dict[str, Any]:
    """Return where the chosen object, target and free place are [m, base_footprint].

    None where there is none, or where it is known in the picture only (see `chosen_boxes`).
    """
    result: dict[str, Any] = {"object": None, "target": None, "area": None}
    if grounded["status"] != STATUS_GROUNDED:
        return result
    if grounded["object"].get("has_geometry", True):
        result["object"] = _point(grounded["object"]["centroid"])
    target = grounded["target"]
    if target["kind"] == TARGET_OBJECT:
        if target["object"].get("has_geometry", True):
            result["target"] = _point(target["object"]["centroid"])
    elif target["kind"] == TARGET_AREA:
        result["area"] = _point(target["pose"]["position"])[:2]
    return result


def chosen_boxes(grounded: Mapping[str, Any] | None) -> dict[str, list[float] | None]:
    """Return the boxes (x_min, y_min, x_max, y_max) [px] of the chosen object and target in the scene's image."""
    boxes: dict[str, list[float] | None] = {"object": None, "target": None}
    if grounded is not None and grounded["status"] == STATUS_GROUNDED:
        boxes["object"] = _box(grounded["object"])
        if grounded["target"]["kind"] == TARGET_OBJECT:
            boxes["target"] = _box(grounded["target"]["object"])
    return boxes


def _box(detection: Mapping[str, Any]) -> list[float]:
    return [round(float(detection[side]), 1) for side in ("x_min", "y_min", "x_max", "y_max")]


def _point(point: Mapping[str, Any]) -> list[float]:
    return [round(float(point[axis]), 4) for axis in "xyz"]


def failure(record: RunRecord) -> str | None:
    """Return in words why nothing came of the run, or None if a command was grounded and its execution did not fail."""
    # A robot that is idle again says so after it has said how it ended.
    execution = next((e for e in reversed(record.of(run_record.EXECUTION)) if e.data["stage"] != STAGE_IDLE), None)
    if execution is not None and execution.data["stage"] in (run_record.STAGE_FAILED, run_record.STAGE_STOPPED):
        return str(execution.data["detail"]) or f"execution ended as {execution.data['stage_name']}"
    grounded = record.last(run_record.GROUNDED)
    if grounded is not None:
        if grounded.data["status"] == STATUS_GROUNDED:
            return None
        return str(grounded.data["reason"]) or "the command could not be grounded"
    command = record.last(run_record.COMMAND)
    if command is not None:
        return str(command.data["reason"]) or "no command was understood"
    if record.of(run_record.TRANSCRIPT):
        return "the words that were heard were not answered"
    status = record.last(run_record.SPEECH_STATUS)
    why = status.data["last_rejection"] if status is not None else ""
    return "I heard no command" + (f": {why}" if why else "")


def backends(record: RunRecord) -> dict[str, str]:
    """Return which back end did each stage, as the results themselves say."""
    found: dict[str, str] = {}
    for stage, kind in (
        ("speech", run_record.TRANSCRIPT),
        ("language", run_record.COMMAND),
        ("hands", run_record.HANDS),
    ):
        event = record.last(kind)
        if event is not None and event.data.get("backend"):
            found[stage] = str(event.data["backend"])
    grounded = record.last(run_record.GROUNDED)
    for entry in grounded.data["backends"] if grounded is not None else ():
        stage, _, name = str(entry).partition("=")
        if name:
            found[stage.strip()] = name.strip()
    return found


def timings(record: RunRecord) -> dict[str, float]:
    """Return times [s]: of the utterance, from its end to each result (ROS clock), and of each stage of execution."""
    result: dict[str, float] = {}
    transcript = record.last(run_record.TRANSCRIPT)
    if transcript is not None and transcript.data["words"]:
        words = transcript.data["words"]
        end_s = float(words[-1]["end"])
        result["utterance"] = end_s - float(words[0]["start"])
        result["recogniser"] = float(transcript.data["latency_s"])
        result["speech_end_to_words"] = transcript.clock_s - end_s
        for name, kind in (
            ("speech_end_to_command", run_record.COMMAND),
            ("speech_end_to_grounded", run_record.GROUNDED),
        ):
            event = _after(record, kind, end_s)
            if event is not None:
                result[name] = event.clock_s - end_s
    for name, seconds in stage_times(record):
        result[f"stage_{name}"] = result.get(f"stage_{name}", 0.0) + seconds
    return {name: round(seconds, 3) for name, seconds in result.items()}


def _after(record: RunRecord, kind: str, clock_s: float) -> Event | None:
    return next((event for event in record.of(kind) if event.clock_s >= clock_s), None)


def stage_times(record: RunRecord) -> list[tuple[str, float]]:
    """Return the stages of execution in order, each with how long it took [s, ROS clock]."""
    stages = [event for event in record.of(run_record.EXECUTION) if event.data["stage"] != STAGE_IDLE]
    times = []
    for event, following in pairwise(stages):
        name = str(event.data["stage_name"] or event.data["stage"]).lower()
        times.append((name, max(0.0, _moment(following) - _moment(event))))
    return times


def _moment(event: Event) -> float:
    return event.stamp_s or event.clock_s
