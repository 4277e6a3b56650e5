# SPDX-License-Identifier: Apache-2.0
"""How far probabilities can be trusted: tables of candidates with the truth, reliability, expected calibration error.

A table is one choice as it was weighed: its candidates with their log factors, and which of them was meant ("none":
what was meant was not there). Tables come from takes with a known truth; nothing else here knows a truth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from uncom_common.transforms import FloatArray
from uncom_perception.types import Scene

from uncom_reasoner.calibration.options import CALIBRATION, CalibrationOptions
from uncom_reasoner.posterior.posterior import NONE
from uncom_reasoner.types import Candidate


@dataclass(frozen=True, slots=True)
class Table:
    """One choice: candidates' ids with their log factors by name, and the id of the one that was meant."""

    part: str
    candidates: tuple[tuple[str, Mapping[str, float]], ...]
    truth: str

    def as_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        rows = [{"id": name, "factors": dict(factors)} for name, factors in self.candidates]
        return {"part": self.part, "candidates": rows, "truth": self.truth}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Table:
        """Read what `as_dict` gave."""
        rows = tuple((str(row["id"]), {k: float(v) for k, v in row["factors"].items()}) for row in data["candidates"])
        return cls(str(data["part"]), rows, str(data["truth"]))


def build_table(part: str, candidates: Sequence[Candidate], truth: str) -> Table:
    """Return the table of what was weighed for a part; a truth that is no candidate counts as none."""
    rows = tuple((c.id, {factor.name: factor.log for factor in c.factors}) for c in candidates)
    return Table(part, rows, truth if truth in {name for name, _ in rows} else NONE)


@dataclass(frozen=True, slots=True)
class Bin:
    """Choices whose probability lies in a range: how many, their mean probability, and the share that was right."""

    low: float
    high: float
    count: int
    probability: float
    right: float


def reliability(probabilities: Sequence[float], right: Sequence[bool], bins: int = CALIBRATION.bins) -> tuple[Bin, ...]:
    """Sort choices into bins of probability; empty bins are left out."""
    p, r = np.asarray(probabilities, dtype=float), np.asarray(right, dtype=float)
    edges = np.linspace(0.0, 1.0, bins + 1)
    places = np.clip(np.digitize(p, edges) - 1, 0, bins - 1)
    return tuple(
        Bin(float(edges[i]), float(edges[i + 1]), int(within.sum()), float(p[within].mean()), float(r[within].mean()))
        for i in range(bins)
        if (within := places == i).any()
    )


def calibration_error(found: Sequence[Bin]) -> float:
    """Return the expected calibration error: the mean gap between probability and share that is right."""
    total = sum(one_bin.count for one_bin in found)
    gaps = sum(one_bin.count * abs(one_bin.probability - one_bin.right) for one_bin in found)
    return gaps / total if total else 0.0


def scene_without(scene: Scene, detection_id: str, options: CalibrationOptions = CALIBRATION) -> Scene:
    """Return a scene as it would be answered without one of its objects: what a speaker of that object would meet.

    Phrase scores are shares of soft memberships f_i with none = prod(1 - f_i) (see objects.phrases of the perception);
    they are undone and shared anew.
    """
    kept = tuple(d for d in scene.detections if d.id != detection_id)
    columns, none = [], []
    for k in range(len(scene.phrase_none)):
        scores = np.array([d.phrase_scores[k] if k < len(d.phrase_scores) else 0.0 for d in scene.detections])
        memberships = _find_memberships(scores, scene.phrase_none[k], options)
        remaining = np.array([f for d, f in zip(scene.detections, memberships, strict=True) if d.id != detection_id])
        no_match = float(np.prod(1.0 - remaining)) if len(remaining) else 1.0
        none.append(no_match)
        total = remaining.sum()
        columns.append(remaining / total * (1.0 - no_match) if total > 0.0 else remaining)
    detections = tuple(
        replace(d, phrase_scores=tuple(float(column[i]) for column in columns)) for i, d in enumerate(kept)
    )
    return replace(scene, detections=detections, phrase_none=tuple(none))


def _find_memberships(scores: FloatArray, none: float, options: CalibrationOptions) -> FloatArray:
    """Return f (N,) with f_i proportional to the scores and prod(1 - f_i) = none."""
    if math.isclose(scores.sum(), 0.0, abs_tol=1e-9) or none >= 1.0:
        return np.zeros_like(scores)
    shape = scores / scores.max()
    low, high = 0.0, options.max_membership
    for _ in range(options.bisection_steps):
        middle = (low + high) / 2.0
        low, high = (middle, high) if float(np.prod(1.0 - middle * shape)) > none else (low, middle)
    return np.asarray(low * shape)
