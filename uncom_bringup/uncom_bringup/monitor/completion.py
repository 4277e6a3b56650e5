# SPDX-License-Identifier: Apache-2.0
"""Whether anything more is to come of what was said: a pure function of the events so far."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import ACT_COMMAND, STATUS_GROUNDED, RunRecord

_ENDED = (run_record.STAGE_DONE, run_record.STAGE_FAILED, run_record.STAGE_STOPPED)


def waiting_for(record: RunRecord, sound_until_s: float | None, with_execution: bool = True) -> str | None:
    """Say what is still to come, or None if everything said so far has been answered.

    Args:
        record: what was seen so far.
        sound_until_s: end of all sound of interest [s, ROS clock]; None while sound may still come.
        with_execution: whether grounded commands will be carried out.
    """
    if sound_until_s is None:
        return "the person to finish"
    status = record.last(run_record.SPEECH_STATUS)
    transcripts = record.of(run_record.TRANSCRIPT)
    if status is None or status.stamp_s < sound_until_s or status.data["state"] != run_record.SPEECH_IDLE:
        return "speech_node to have examined all sound"
    commands = record.of(run_record.COMMAND)
    answered = Counter(event.data["utterance_id"] for event in commands)
    expected = {event.data["utterance_id"]: max(1, int(event.data["count"])) for event in commands}
    for transcript in transcripts:
        utterance = transcript.data["utterance_id"]
        if answered[utterance] < expected.get(utterance, 1):
            return f'language_node to answer "{transcript.data["text"]}"'
    return _decisions_missing(record, with_execution)


def _decisions_missing(record: RunRecord, with_execution: bool) -> str | None:
    decided = {_key(event.data): event.data for event in record.of(run_record.GROUNDED)}
    ended = {_key(event.data) for event in record.of(run_record.EXECUTION) if event.data["stage"] in _ENDED}
    for event in record.of(run_record.COMMAND):
        if event.data["act"] != ACT_COMMAND:
            continue
        key = _key(event.data)
        if key not in decided:
            return f'reasoner_node to decide on "{event.data["text"]}"'
        if with_execution and decided[key]["status"] == STATUS_GROUNDED and key not in ended:
            return f'execution_node to carry out "{event.data["text"]}"'
    return None


def _key(data: Mapping[str, Any]) -> tuple[str, int]:
    return str(data["utterance_id"]), int(data["index"])
