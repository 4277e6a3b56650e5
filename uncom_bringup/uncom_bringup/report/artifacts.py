# SPDX-License-Identifier: Apache-2.0
"""Writes what a run leaves behind: command.json, annotated_action.png, report.html, video.mp4."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from uncom_bringup.bags.image_codec import decode_colour, encode_png
from uncom_bringup.monitor import run_record as kinds
from uncom_bringup.monitor.run_record import RunRecord
from uncom_bringup.report import video
from uncom_bringup.report.answer import answer, lasting, utterance_names
from uncom_bringup.report.page import Outcome, write_report

COMMANDS, PICTURE, REPORT, VIDEO, BAG = "command.json", "annotated_action.png", "report.html", "video.mp4", "run.mcap"


def write_commands(path: Path, record: RunRecord, heard: str) -> None:
    """Write what was understood and grounded, with the reasons, as JSON (one entry a command).

    Nothing in it differs between two runs of one bag.
    """
    names = utterance_names(record)
    entries = []
    for event in record.of(kinds.COMMAND):
        key = (event.data["utterance_id"], event.data["index"])
        grounded = [e.data for e in record.of(kinds.GROUNDED) if (e.data["utterance_id"], e.data["index"]) == key]
        entries.append(
            {
                "command": lasting(event.data, names),
                "grounded": lasting(grounded[-1], names) if grounded else None,
                "explanation": lasting(record.explanation_of(*key), names),
            }
        )
    transcripts = [lasting(event.data, names) for event in record.of(kinds.TRANSCRIPT)]
    content = {"heard": heard, "answer": answer(record), "transcripts": transcripts, "commands": entries}
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def write_picture(path: Path, record: RunRecord) -> bool:
    """Write the last annotated picture; False if there is none."""
    if not record.annotated:
        return False
    path.write_bytes(encode_png(decode_colour(record.annotated[-1].jpeg)))
    return True


def write_all(
    folder: Path,
    title: str,
    record: RunRecord,
    outcome: Outcome,
    timings_s: Mapping[str, float],
    *,
    heard: str,
    span_s: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """Write everything that can be made of a record; returns the paths by what they are (without what is missing).

    span_s is the time that the video shows [ROS clock]; without it there is no video. A bag that lies in the folder
    already is listed, too.
    """
    made: dict[str, Any] = {}
    write_commands(folder / COMMANDS, record, heard)
    made["command"] = COMMANDS
    if write_picture(folder / PICTURE, record):
        made["picture"] = PICTURE
    if span_s is not None and video.write_video(folder / VIDEO, record, *span_s):
        made["video"] = VIDEO
    if (folder / BAG).exists():
        made["bag"] = BAG
    write_report(folder / REPORT, title, record, outcome, timings_s, tuple(made.values()))
    made["report"] = REPORT
    return {name: str(folder / file) for name, file in made.items()}
