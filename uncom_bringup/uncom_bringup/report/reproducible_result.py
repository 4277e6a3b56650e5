# SPDX-License-Identifier: Apache-2.0
"""What was understood, without what differs from run to run: no latencies, no times of day, no names drawn by chance.

Two runs of one bag with one set of parameters give the same answer, digit for digit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import ACT_NAMES, PRIMITIVE_NAMES, STATUS_NAMES, RunRecord, name_of
from uncom_bringup.report import summary
from uncom_bringup.report.options import RESULT

COMMANDS_FILE = "command.json"  # the file of a run that holds it
# Fields that tell of the machine and the moment, not of what was said and seen.
_RUN_SPECIFIC_FIELDS = frozenset({"latency_s", "session"})


def reproducible_result(record: RunRecord) -> dict[str, Any]:
    """Return what was heard, understood, weighed and chosen, ready for JSON; numbers have six digits."""
    names = utterance_names(record)
    found: dict[str, Any] = {
        "heard": summary.heard(record),
        "utterances": [_utterance(event.data) for event in record.of(run_record.TRANSCRIPT)],
        "commands": [_command(record, event.data, names) for event in record.of(run_record.COMMAND)],
        "questions": [event.data["text"] for event in record.of(run_record.QUESTION)],
        "said": [event.data["data"] for event in record.of(run_record.SAY)],
        "reason": summary.failure(record) or "",
        "backends": summary.backends(record),
    }
    rounded: dict[str, Any] = _rounded(found)
    return rounded


def utterance_names(record: RunRecord) -> dict[str, str]:
    """Return short names (utterance-1, ...) of the utterances in the order in which they were heard."""
    kinds_with_id = (run_record.TRANSCRIPT, run_record.COMMAND, run_record.GROUNDED)
    ids = dict.fromkeys(str(e.data["utterance_id"]) for e in record.events if e.kind in kinds_with_id)
    return {name: f"utterance-{number}" for number, name in enumerate(ids, start=1)}


def without_run_specifics(value: Any, names: Mapping[str, str]) -> Any:
    """Copy plain values without what differs from run to run; utterances get the names given."""
    if isinstance(value, Mapping):
        kept = {
            key: without_run_specifics(item, names) for key, item in value.items() if key not in _RUN_SPECIFIC_FIELDS
        }
        if "utterance_id" in kept:
            kept["utterance_id"] = names.get(str(kept["utterance_id"]), kept["utterance_id"])
        if "status" in kept and "header" in kept:  # a decision is stamped with when it was made
            kept.pop("header")
        return kept
    if isinstance(value, (list, tuple)):
        return [without_run_specifics(item, names) for item in value]
    return value


def _utterance(data: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "text": data["text"],
        "words": [
            {"text": word["text"], "start": word["start"], "end": word["end"], "confidence": word["confidence"]}
            for word in data["words"]
        ],
        "alternatives": [{"text": other["text"], "score": other["score"]} for other in data["alternatives"]],
    }


def _command(record: RunRecord, data: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    key = (data["utterance_id"], data["index"])
    grounded = [e.data for e in record.of(run_record.GROUNDED) if (e.data["utterance_id"], e.data["index"]) == key]
    return {
        "utterance": names[str(data["utterance_id"])],
        "index": data["index"],
        "act": name_of(ACT_NAMES, data["act"]),
        "reason": data["reason"],
        "text": data["text"],
        "object": _words(data["object"]),
        "action": data["action_text"] or name_of(PRIMITIVE_NAMES, data["primitive"]),
        "target": _words(data["target"]),
        "relation": data["relation"] or "none",
        "decisions": [_decision(decision) for decision in grounded],
    }


def _words(reference: Mapping[str, Any]) -> str | None:
    return str(reference["text"]) if reference["present"] else None


def _decision(data: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "status": name_of(STATUS_NAMES, data["status"]),
        "reason": data["reason"],
        "object_probability": data["object_probability"],
        "target_probability": data["target_probability"],
        "chosen": summary.chosen_places(data),
        "object_candidates": [_candidate(candidate) for candidate in data["object_candidates"]],
        "target_candidates": [_candidate(candidate) for candidate in data["target_candidates"]],
        "frames": {"object": data["object_frame_stamp"], "target": data["target_frame_stamp"]},
    }


def _candidate(data: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "label": data["label"],
        "box": [data[side] for side in ("x_min", "y_min", "x_max", "y_max")],
        "probability": data["probability"],
        "factors": dict(zip(data["factor_names"], data["factor_logs"], strict=False)),
        "chosen": data["chosen"],
    }


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, RESULT.digits)
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    return value
