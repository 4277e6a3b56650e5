# SPDX-License-Identifier: Apache-2.0
"""Counts over all takes: by scenario, by subject, by stage; the values behind text, JSON and page."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

from uncom_sim.bench_understanding.judging.decision_quality import decision_report
from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.judging.statistics import quantile, wilson
from uncom_sim.bench_understanding.reporting.options import REPORTS, ReportOptions
from uncom_sim.bench_understanding.takes.scenarios import scenario
from uncom_sim.bench_understanding.takes.types import SUBJECTS

ABLATIONS = ("true_words", "true_detections", "no_gesture", "gesture_only")


def report_of(
    outcomes: Sequence[Outcome], *, seed: int, jobs: int, wall_s: float, options: ReportOptions = REPORTS
) -> dict[str, Any]:
    """Return all counts, shares and 95 % intervals as JSON values."""
    right = sum(one.right for one in outcomes)
    low, high = wilson(right, len(outcomes))
    paper = wilson(options.paper_right, options.paper_takes)
    made = [one.made_s for one in outcomes if one.made_s > 0.0]
    return {
        "takes": len(outcomes),
        "right": right,
        "share": round(right / len(outcomes), 4) if outcomes else 0.0,
        "interval": [round(low, 4), round(high, 4)],
        "seed": seed,
        "paper": {
            "takes": options.paper_takes,
            "right": options.paper_right,
            "interval": [round(value, 4) for value in paper],
        },
        "scenarios": _scenarios(outcomes),
        "subjects": _subjects(outcomes),
        "stages": dict(Counter(one.stage or "unknown" for one in outcomes if not one.right)),
        "manners": _shares(outcomes, lambda one: one.manner),
        "published_rules": _variant(outcomes, "published"),
        "ablations": {name: _variant(outcomes, name) for name in ABLATIONS},
        "checks": _checks(outcomes),
        "relations": _confusion(outcomes),
        "deciding": decision_report(outcomes),
        "latency_s": _latency(outcomes),
        "made": {"takes": len(made), "cpu_s": round(sum(made) / len(made), 2) if made else 0.0},
        "jobs": jobs,
        "wall_s": round(wall_s, 1),
        "misses": [_miss(one) for one in outcomes if not one.right],
    }


def _variant(outcomes: Sequence[Outcome], name: str) -> dict[str, Any]:
    known = [one.variants[name] for one in outcomes if name in one.variants]
    return {
        "takes": len(known),
        "right": sum(known),
        "interval": [round(value, 4) for value in wilson(sum(known), len(known))],
    }


def _checks(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return what the score falls to when words or hands are not the take's own.

    Sentences are swapped within a scenario; by chance, a sentence of another take speaks of the same objects in the
    same way. Deictic takes cannot be told without the hand.
    """
    swapped = [one for one in outcomes if "swapped_words" in one.variants]
    differing = [one for one in swapped if not one.swapped_fits]
    deictic = [one for one in outcomes if "deixis" in (one.subjects["object"], one.subjects["target"])]
    pointed = [one for one in deictic if "no_gesture" in one.variants]
    return {
        "swapped_words": {
            "takes": len(swapped),
            "right": sum(one.variants["swapped_words"] for one in swapped),
            "chance": sum(one.swapped_fits for one in swapped),
            "other_meaning": {
                "takes": len(differing),
                "right": sum(one.variants["swapped_words"] for one in differing),
            },
        },
        "hand_removed_deictic": {
            "takes": len(pointed),
            "right": sum(one.variants["no_gesture"] for one in pointed),
            "right_with_hand": sum(one.right for one in pointed),
        },
    }


def _scenarios(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    by_number: dict[int, list[Outcome]] = defaultdict(list)
    for one in outcomes:
        by_number[one.scenario].append(one)
    return [
        {
            "id": number,
            "name": scenario(number).name,
            "takes": len(of),
            "right": sum(one.right for one in of),
            **scenario(number).subjects(),
        }
        for number, of in sorted(by_number.items())
    ]


def _subjects(outcomes: Sequence[Outcome]) -> dict[str, dict[str, dict[str, Any]]]:
    return {name: _shares(outcomes, lambda one, name=name: one.subjects[name]) for name in SUBJECTS}


def _shares(outcomes: Sequence[Outcome], group: Any) -> dict[str, dict[str, Any]]:
    by_group: dict[str, list[bool]] = defaultdict(list)
    for one in outcomes:
        by_group[str(group(one))].append(one.right)
    return {
        name: {
            "takes": len(of),
            "right": sum(of),
            "interval": [round(value, 4) for value in wilson(sum(of), len(of))],
        }
        for name, of in sorted(by_group.items())
    }


def _confusion(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for one in outcomes:
        table[one.relation][one.understood_relation] += 1
    return {meant: dict(sorted(got.items())) for meant, got in sorted(table.items())}


def _latency(outcomes: Sequence[Outcome]) -> dict[str, dict[str, float]]:
    stages: dict[str, list[float]] = defaultdict(list)
    for one in outcomes:
        for name, spent in one.latency_s.items():
            stages[name].append(spent)
    return {
        name: {"mean": round(sum(spent) / len(spent), 3), "p95": round(quantile(spent, 0.95), 3)}
        for name, spent in stages.items()
    }


def _miss(one: Outcome) -> dict[str, Any]:
    return {
        "take": one.take,
        "scenario": one.scenario,
        "index": one.index,
        "manner": one.manner,
        "said": one.said,
        "heard": one.heard,
        "meant": one.meant,
        "got": one.got,
        "stage": one.stage,
        "why": one.why,
    }
