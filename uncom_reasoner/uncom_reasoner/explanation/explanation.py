# SPDX-License-Identifier: Apache-2.0
"""Why a command was understood as it was, as a JSON object; every number in it is the number that was used.

Layout (positions on the support are [x, y] in metres, or pixels if `table.metric` is false)::

    {"utterance_id", "index", "heard": the words, "status": "GROUNDED" | "FAILED" | "AMBIGUOUS" | "CANCELLED", "reason",
     "command": {"object", "action", "target", "relation", "primitive",
                 "spans": {"object" | "action" | "target" | "reference2": [start, end] [s]}},
     "frames": {"scene", "object", "target"} stamps [s],
     "rays": {"object" | "target": {"span": [start, end], "weight", "present",
              "dwells": [{"share", "hand", "sigma_rad", "stamps", "stillness", "tip_px", "direction_px",
                          "tip": [x, y, z] | null, "direction": [x, y, z] | null}]}},
     "table": {"metric", "polygon": [[x, y], ...]},
     "part", "parts": of a group; "group": [CANDIDATE] what its objects were chosen from,
     "object": {"chosen": id | null, "probability", "rule": RULE | null, "candidates": [CANDIDATE]},
     "target": {"kind": "NONE" | "OBJECT" | "AREA", "chosen": id | null, "probability", "rule", "candidates",
                "position": [x, y, z] in the scene's frame | null,
                "point": {"mean": [x, y], "covariance": [[..], [..]]} | null where the gesture meets the table},
     "reference": {"chosen", "probability", "rule", "candidates"} | null: the object that the target's place is
                  relative to; "second": the same for B of "between A and B",
     "doubt": {"part", "choices": ids} | null: what is asked about,
     "perspective": "robot" | "speaker" | "": whose left and right was taken,
     "readings": [{"perspective", "prior", "probability", "outcome", "chosen"}],
     "cells": [{"id", "polygon", "centre", "occupied_by": ids or "", "chosen"}],
     "refused": interpretations not taken, "notes": [...],
     "without": {"gesture" | "words": {"object" | "target": {"likeliest", "probability"}}},
     "thresholds": {"min_probability", "min_odds"}, "backends": [...]}

CANDIDATE is {"id", "label", "box": [x_min, y_min, x_max, y_max] | null, "factors": {name: log}, "log", "probability",
"chosen"}: log is the sum of the factors, the probabilities are exp(log) normalised over the candidates;
posterior/object_likelihood.py and support/free_place_search.py say what the factors are. RULE tells why the likeliest
one was taken: "clear" (its share among the objects is at least min_probability and its odds against the second are at
least min_odds), "any will do" (the speaker left it open), or "best place". So every choice can be worked out again from
the tables.
"""

from __future__ import annotations

from typing import Any

from uncom_common.transforms import FloatArray
from uncom_language.types import Command

from uncom_reasoner.gesture_types import Dwell, PhraseRay
from uncom_reasoner.types import Candidate, Choice, Decision, Interpretation, Status, TargetKind
from uncom_reasoner.weights import Weights


def explain(command: Command, decision: Decision, scene_frame_s: float, weights: Weights) -> dict[str, Any]:
    """Build the JSON object of a decision."""
    g = decision.grounded
    point = decision.target_point
    return {
        "utterance_id": g.utterance_id,
        "index": g.index,
        "heard": command.text,
        "status": Status(g.status).name,
        "reason": g.reason,
        "command": _command(command, decision),
        "frames": {"scene": scene_frame_s, "object": g.object_frame_s, "target": g.target_frame_s},
        "rays": {ray.role: _ray(ray) for ray in (decision.object_ray, decision.target_ray) if ray is not None},
        "table": {"metric": decision.metric, "polygon": _numbers(decision.outline)},
        "part": g.part,
        "parts": g.parts,
        "group": [_candidate(c) for c in decision.group],
        "object": {
            "chosen": g.object.id if g.object is not None else None,
            "probability": g.object_probability,
            "rule": _rule(decision, "object"),
            "candidates": [_candidate(c) for c in g.object_candidates],
        },
        "target": {
            "kind": TargetKind(g.target.kind).name,
            "chosen": next((c.id for c in g.target_candidates if c.chosen), None),
            "probability": next((c.probability for c in g.target_candidates if c.chosen), 0.0),
            "rule": _rule(decision, "target"),
            "candidates": [_candidate(c) for c in g.target_candidates],
            "position": _numbers(g.target.pose[:3, 3]) if g.target.pose is not None else None,
            "point": {"mean": _numbers(point.mean), "covariance": _numbers(point.covariance)} if point else None,
        },
        "reference": _choice(decision.reference) if decision.reference is not None else None,
        "second": _choice(decision.second) if decision.second is not None else None,
        "doubt": {"part": decision.doubt.part, "choices": list(decision.doubt.choices)} if decision.doubt else None,
        "perspective": decision.perspective,
        "readings": [_interpretation(i) for i in decision.interpretations],
        "cells": _cells(decision),
        "refused": list(decision.refused),
        "notes": list(decision.notes),
        "without": _without(decision),
        "thresholds": {"min_probability": weights.min_probability, "min_odds": weights.min_odds},
        "backends": list(g.backends),
    }


def _interpretation(interpretation: Interpretation) -> dict[str, Any]:
    return {
        "perspective": interpretation.perspective,
        "prior": interpretation.prior,
        "probability": interpretation.probability,
        "outcome": interpretation.outcome,
        "chosen": interpretation.chosen,
    }


def _rule(decision: Decision, part: str) -> str | None:
    rule = decision.rules.get(part)
    return rule.value if rule is not None else None


def _command(command: Command, decision: Decision) -> dict[str, Any]:
    g = decision.grounded
    parts = {
        "object": command.object.span if command.object else None,
        "action": command.action_span,
        "target": command.target.span if command.target else None,
        "reference2": command.reference2.span if command.reference2 else None,
    }
    return {
        "object": g.object_text,
        "action": g.action_text,
        "target": g.target_text,
        "relation": g.relation,
        "primitive": g.primitive.value,
        "spans": {name: [span.start_s, span.end_s] for name, span in parts.items() if span is not None},
    }


def _ray(ray: PhraseRay) -> dict[str, Any]:
    return {
        "span": [ray.start_s, ray.end_s],
        "weight": ray.weight,
        "present": ray.present,
        "dwells": [_dwell(dwell, share) for dwell, share in ray.dwells],
    }


def _dwell(dwell: Dwell, share: float) -> dict[str, Any]:
    space = dwell.space
    return {
        "share": share,
        "hand": dwell.hand,
        "sigma_rad": dwell.sigma_rad,
        "stamps": list(dwell.stamps_s),
        "stillness": list(dwell.stillness),
        "tip_px": _numbers(dwell.tip_px),
        "direction_px": _numbers(dwell.direction_px),
        "tip": _numbers(space.tip) if space is not None else None,
        "direction": _numbers(space.direction) if space is not None else None,
    }


def _choice(choice: Choice) -> dict[str, Any]:
    return {
        "chosen": choice.chosen,
        "probability": choice.probability,
        "rule": choice.rule.value,
        "candidates": [_candidate(c) for c in choice.candidates],
    }


def _candidate(candidate: Candidate) -> dict[str, Any]:
    box = candidate.box
    return {
        "id": candidate.id,
        "label": candidate.label,
        "box": [float(v) for v in (box.x_min, box.y_min, box.x_max, box.y_max)] if box is not None else None,
        "factors": {factor.name: factor.log for factor in candidate.factors},
        "log": candidate.log,
        "probability": candidate.probability,
        "chosen": candidate.chosen,
    }


def _cells(decision: Decision) -> list[dict[str, Any]]:
    chosen = {c.id for c in decision.grounded.target_candidates if c.chosen}
    return [
        {
            "id": cell.id,
            "polygon": _numbers(cell.polygon),
            "centre": _numbers(cell.centre),
            "occupied_by": cell.occupied_by,
            "chosen": cell.id in chosen,
        }
        for cell in decision.cells
    ]


def _without(decision: Decision) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {}
    for c in decision.counterfactuals:
        result.setdefault(c.without, {})[c.part] = {"likeliest": c.likeliest, "probability": c.probability}
    return result


def _numbers(values: FloatArray) -> Any:
    return values.astype(float).tolist()
