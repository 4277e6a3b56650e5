# SPDX-License-Identifier: Apache-2.0
"""Writes what a run leaves behind: command.json, annotated_action.png, report.html, video.mp4."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from uncom_bringup.bags.image_codec import decode_colour, encode_png
from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import RunRecord
from uncom_bringup.report import video
from uncom_bringup.report.report_page import Outcome, write_report
from uncom_bringup.report.reproducible_result import (
    COMMANDS_FILE,
    reproducible_result,
    utterance_names,
    without_run_specifics,
)

PICTURE_FILE = "annotated_action.png"
REPORT_FILE = "report.html"
VIDEO_FILE = "video.mp4"
BAG_FILE = "run.mcap"


def write_commands(path: Path, record: RunRecord, heard: str) -> None:
    """Write what was understood and grounded, with the reasons, as JSON (one entry a command).

    Nothing in it differs between two runs of one bag.
    """
    names = utterance_names(record)
    entries = []
    for event in record.of(run_record.COMMAND):
        key = (event.data["utterance_id"], event.data["index"])
        grounded = [e.data for e in record.of(run_record.GROUNDED) if (e.data["utterance_id"], e.data["index"]) == key]
        entries.append(
            {
                "command": without_run_specifics(event.data, names),
                "grounded": without_run_specifics(grounded[-1], names) if grounded else None,
                "explanation": without_run_specifics(record.explanation_of(*key), names),
            }
        )
    transcripts = [without_run_specifics(event.data, names) for event in record.of(run_record.TRANSCRIPT)]
    content = {"heard": heard, "answer": reproducible_result(record), "transcripts": transcripts, "commands": entries}
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def write_picture(path: Path, record: RunRecord) -> bool:
    """Write the last annotated picture; False if there is none."""
    if not record.annotated:
        return False
    path.write_bytes(encode_png(decode_colour(record.annotated[-1].jpeg)))
    return True


def write_run_files(
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
    write_commands(folder / COMMANDS_FILE, record, heard)
    made["command"] = COMMANDS_FILE
    if write_picture(folder / PICTURE_FILE, record):
        made["picture"] = PICTURE_FILE
    if span_s is not None and video.write_video(folder / VIDEO_FILE, record, *span_s):
        made["video"] = VIDEO_FILE
    if (folder / BAG_FILE).exists():
        made["bag"] = BAG_FILE
    write_report(folder / REPORT_FILE, title, record, outcome, timings_s, tuple(made.values()))
    made["report"] = REPORT_FILE
    return {name: str(folder / file) for name, file in made.items()}
