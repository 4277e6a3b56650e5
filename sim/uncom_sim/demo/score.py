# SPDX-License-Identifier: Apache-2.0
"""Scores a demo by the simulator's truth: the objects that were chosen, and the end state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import STATUS_GROUNDED, RunRecord
from uncom_bringup.report import summary

from uncom_sim.scoring.end_state import PhysicalResult, judge, nearest_object
from uncom_sim.types import Meaning, ObjectState, Scene

_NO_CHOICE: Mapping[str, Any] = {"object": None, "target": None, "area": None}


@dataclass(frozen=True, slots=True)
class Score:
    """Ids (or a place) that were chosen, and the physical result."""

    chosen: Mapping[str, Any]
    physical: PhysicalResult


def score_run(scene: Scene, record: RunRecord, before: Sequence[ObjectState], after: Sequence[ObjectState]) -> Score:
    """Score a run.

    The goal is what the person meant. Where the words leave that open, the goal is what the robot itself had chosen
    to do, and the reason says so.
    """
    grounded = [e.data for e in record.of(run_record.GROUNDED) if e.data["status"] == STATUS_GROUNDED]
    chosen = _chosen(grounded[-1], before) if grounded else _NO_CHOICE
    if not before or not after:
        return Score(chosen, PhysicalResult(False, "the simulator told no state", 0.0, 0.0))
    if scene.meaning is not None:
        return Score(chosen, judge(before, after, scene.meaning, scene.table))
    goal = _goal_chosen_by_robot(grounded[-1], chosen) if grounded else None
    if goal is None:
        return Score(chosen, PhysicalResult(False, "nothing was to be done", 0.0, _most_moved(before, after)))
    result = judge(before, after, goal, scene.table)
    reason = f"{result.reason} (judged by what the robot chose: what was meant is open)"
    return Score(chosen, PhysicalResult(result.success, reason, result.object_moved_m, result.others_moved_m))


def _chosen(grounded: Mapping[str, Any], before: Sequence[ObjectState]) -> dict[str, Any]:
    places = summary.chosen_places(grounded)

    def name(place: Sequence[float] | None) -> str | None:
        return None if place is None else nearest_object(before, place[0], place[1])

    return {"object": name(places["object"]), "target": name(places["target"]), "area": places["area"]}


def _goal_chosen_by_robot(grounded: Mapping[str, Any], chosen: Mapping[str, Any]) -> Meaning | None:
    if chosen["object"] is None:
        return None
    if chosen["target"] is not None:
        relation = grounded["relation"] if grounded["relation"] in ("in", "on") else "on"
        return Meaning(chosen["object"], relation, chosen["target"])
    if chosen["area"] is not None:
        x, y = chosen["area"]
        return Meaning(chosen["object"], "area", None, (x, y))
    return Meaning(chosen["object"], "none")


def _most_moved(before: Sequence[ObjectState], after: Sequence[ObjectState]) -> float:
    now = {state.id: state.position for state in after}
    return max((float(abs(now[s.id] - s.position).max()) for s in before if s.id in now), default=0.0)
