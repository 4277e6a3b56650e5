# SPDX-License-Identifier: Apache-2.0
"""What a bag came to: the artefacts in its folder, and the JSON of `uncom understand`."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import STATUS_GROUNDED, RunRecord
from uncom_bringup.report import progress, run_files, summary
from uncom_bringup.report.report_page import Outcome
from uncom_bringup.report.reproducible_result import reproducible_result


@dataclass(frozen=True, slots=True)
class UnderstandingResult:
    """What the graph made of a bag; how many pictures it was shown, and how many of them were examined."""

    record: RunRecord
    pictures: int
    examined: int

    def reproducible_result(self) -> dict[str, Any]:
        """Return what is the same in every run of the bag."""
        return {**reproducible_result(self.record), "pictures": self.pictures, "examined": self.examined}


def write_result(folder: Path, title: str, result: UnderstandingResult, begin_s: float) -> dict[str, Any]:
    """Write report, picture and command.json; return what `uncom understand --json` prints.

    begin_s is when the work began [s, monotonic]. All but `timings_s` and `artifacts` is the same in every run.
    """
    record = result.record
    grounded = [event.data for event in record.of(run_record.GROUNDED) if event.data["status"] == STATUS_GROUNDED]
    reason = summary.failure(record) or ""
    heard = summary.heard(record)
    times = {**summary.timings(record), "wall_total": round(time.monotonic() - begin_s, 3)}
    words = reason or progress.caption(record.of(run_record.COMMAND)[-1].data)
    made = run_files.write_run_files(
        folder, title, record, Outcome(None if grounded else False, words), times, heard=heard
    )
    nowhere = {"object": None, "target": None, "area": None}
    return {
        "heard": heard,
        "understood": summary.understood(record),
        "chosen": summary.chosen_places(grounded[-1]) if grounded else nowhere,
        "boxes": summary.chosen_boxes(grounded[-1] if grounded else None),
        "success": bool(grounded) and not reason,
        "reason": reason,
        "answer": result.reproducible_result(),
        "timings_s": times,
        "backends": summary.backends(record),
        "artifacts": {**made, "log": str(folder / "log")},
    }
