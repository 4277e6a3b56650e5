# SPDX-License-Identifier: Apache-2.0
"""Quality of the decision of a take: its confidence, the effect of one truthful answer, and its tables of factors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from uncom_reasoner.calibration.calibration import build_table, calibration_error, reliability, scene_without
from uncom_reasoner.detector_phrases import is_bare
from uncom_reasoner.dialogue.conversation import Conversation, Turn
from uncom_reasoner.posterior.posterior import NONE
from uncom_reasoner.types import Candidate, Decision, Evidence, GroundedCommand, Status

from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.judging.verdict import judge, matched_object_id
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.types import ObjectState


def assess_decision(
    talk: Conversation, plan: TakePlan, states: Sequence[ObjectState], evidence: Evidence
) -> dict[str, Any]:
    """Decide once more, answer one question truthfully, and keep the tables, as JSON values."""
    turn = talk.decide(evidence, 0.0)
    decision = turn.decisions[0]
    grounded = decision.grounded
    after = _decide_after_answer(talk, turn, plan, states, evidence) if turn.question is not None else decision
    return {
        "status": Status(grounded.status).name.lower(),
        "asked": turn.question.text if turn.question is not None else "",
        "right": judge(plan, states, grounded).right,
        "right_after_one_answer": judge(plan, states, after.grounded).right,
        "probability": _confidence(grounded),
        "tables": [
            *_factor_tables(decision, plan, states, evidence),
            *_tables_without_object(talk, plan, states, evidence),
        ],
    }


def _confidence(grounded: GroundedCommand) -> float:
    place = grounded.target.detection is None and grounded.target.pose is not None
    target = grounded.target_probability if grounded.target.detection is not None or not place else 1.0
    return float(grounded.object_probability * (target or 1.0)) if grounded.status is Status.GROUNDED else 0.0


def _decide_after_answer(
    talk: Conversation, turn: Turn, plan: TakePlan, states: Sequence[ObjectState], evidence: Evidence
) -> Decision:
    """Answer as the person who knows what was meant: a choice if it is offered, else no."""
    question = turn.question
    if question is None:
        return turn.decisions[0]
    meant = plan.meaning.object if question.part == "object" else plan.meaning.target
    offered = [name for name in question.candidate_ids if _is_object(name, meant, states, evidence)]
    ending = talk.dialogue.pointed(offered[0]) if offered else None
    following = talk.conclude(ending, 1.0) if ending is not None else None
    return following.decisions[0] if isinstance(following, Turn) else turn.decisions[0]


def _is_object(thing_id: str, meant: str | None, states: Sequence[ObjectState], evidence: Evidence) -> bool:
    return any(d.id == thing_id and matched_object_id(d, states) == meant for d in evidence.scene.detections)


def _true_detection_id(meant: str | None, states: Sequence[ObjectState], evidence: Evidence) -> str:
    return next((d.id for d in evidence.scene.detections if matched_object_id(d, states) == meant), NONE)


def _factor_tables(
    decision: Decision, plan: TakePlan, states: Sequence[ObjectState], evidence: Evidence
) -> list[dict[str, Any]]:
    parts: list[tuple[str, Sequence[Candidate], str | None]] = [
        ("object", decision.grounded.object_candidates, plan.meaning.object)
    ]
    if plan.meaning.target is not None:
        of_target = decision.reference.candidates if decision.reference else decision.grounded.target_candidates
        if not any(c.id.startswith("cell") for c in of_target):
            parts.append(("target", of_target, plan.meaning.target))
    return [
        build_table(name, candidates, _true_detection_id(meant, states, evidence)).as_dict()
        for name, candidates, meant in parts
        if candidates
    ]


def _tables_without_object(
    talk: Conversation, plan: TakePlan, states: Sequence[ObjectState], evidence: Evidence
) -> list[dict[str, Any]]:
    """Weigh the object once more with it taken away: a named object that is not there, and no other of its kind."""
    meant = plan.scene.object(plan.meaning.object)
    alike = [obj for obj in plan.scene.objects if obj.kind == meant.kind]
    reference = evidence.command.object
    true_id = _true_detection_id(meant.id, states, evidence)
    if reference is None or is_bare(reference) or len(alike) > 1 or true_id == NONE:
        return []
    gone = replace(evidence, scene=scene_without(evidence.scene, true_id))
    found = talk.decide(gone, 0.0).decisions[0].grounded.object_candidates
    talk.drop_question()
    return [build_table("object", found, NONE).as_dict()] if found else []


def decision_report(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Count over all takes: accepted, wrong among them, asked, right after one answer, reliability."""
    kept = [one.notes["deciding"] for one in outcomes if "deciding" in one.notes]
    accepted = [one for one in kept if one["status"] == "grounded"]
    asked = [one for one in kept if one["asked"]]
    bins = reliability([one["probability"] for one in accepted], [one["right"] for one in accepted])
    return {
        "takes": len(outcomes),
        "accepted": len(accepted),
        "wrong_among_accepted": sum(not one["right"] for one in accepted),
        "asked": len(asked),
        "right_after_one_answer": sum(one["right_after_one_answer"] for one in kept),
        "calibration_error": round(calibration_error(bins), 4),
        "reliability": [
            {
                "low": round(one.low, 2),
                "high": round(one.high, 2),
                "count": one.count,
                "probability": round(one.probability, 4),
                "right": round(one.right, 4),
            }
            for one in bins
        ],
    }


def decision_text(report: Mapping[str, Any]) -> str:
    """Return the counts in two lines."""
    if not report["takes"]:
        return ""
    n = report["takes"]
    return (
        f"accepted {report['accepted']} of {n}, wrong among them {report['wrong_among_accepted']}; "
        f"asked about {report['asked']} ({100 * report['asked'] / n:.0f} %), "
        f"right after at most one answer {report['right_after_one_answer']}\n"
        f"expected calibration error {report['calibration_error']:.3f}"
    )
