# SPDX-License-Identifier: Apache-2.0
"""Checkpoint of a run in progress, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import uncom_common
import uncom_language
import uncom_perception
import uncom_reasoner
import uncom_sim
from uncom_sim.bench_understanding.judging.outcome import Outcome


def sources_digest() -> str:
    """Return a digest of all that understands and scores: outcomes of other sources are of no use."""
    digest = hashlib.sha256()
    for package in (uncom_common, uncom_language, uncom_perception, uncom_reasoner, uncom_sim):
        root = Path(str(package.__path__[0]))
        for file in sorted(root.rglob("*")):
            if file.suffix in (".py", ".yaml", ".lark", ".npz", ".json"):
                digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


class RunCheckpoint:
    """A file with one outcome a line."""

    def __init__(self, folder: Path, identity: dict[str, Any], *, fresh: bool = False) -> None:
        """Open the checkpoint of a run of this identity (options, plans and sources)."""
        name = hashlib.sha256(json.dumps(identity, sort_keys=True, default=str).encode()).hexdigest()[:16]
        self._path = folder / "runs" / f"{name}.jsonl"
        self._path.parent.mkdir(parents=True, exist_ok=True)
        if fresh:
            self._path.unlink(missing_ok=True)

    def outcomes(self) -> dict[str, Outcome]:
        """Return what is known already, by take; a line that was cut off is left out."""
        found: dict[str, Outcome] = {}
        for line in self._lines():
            try:
                outcome = Outcome.from_dict(json.loads(line))
            except (ValueError, TypeError):
                continue
            found[outcome.take] = outcome
        return found

    def _lines(self) -> Iterable[str]:
        return self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else ()

    def add(self, outcome: Outcome) -> None:
        """Write one outcome."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(outcome.as_dict()) + "\n")

    def finish(self) -> None:
        """The run is complete: the next one measures anew."""
        self._path.unlink(missing_ok=True)
