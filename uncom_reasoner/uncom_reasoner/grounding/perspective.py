# SPDX-License-Identifier: Apache-2.0
"""Whose left and right: the robot's and the speaker's side are separate readings of the same words.

Each is decided by itself. If both would do the same, or one is clearly likelier by its prior, nothing is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from uncom_reasoner.config import PERSPECTIVES, PlacingConfig
from uncom_reasoner.types import Decision, Doubt, GroundedCommand, Reading, Status
from uncom_reasoner.weights import Weights

SAME_PLACE_M = 0.06
# A reading that cannot be done is less likely meant, but an impossible wish stays more likely than the odd side.
FEASIBLE = {Status.GROUNDED: 1.0, Status.AMBIGUOUS: 0.7, Status.FAILED: 0.4, Status.CANCELLED: 0.4}
LEAST_PRIOR = 0.02
SIDE_WORDS = {"robot": "as I see it", "speaker": "as you see it"}

Decide = Callable[[PlacingConfig], Decision]


def decide_side(decide: Decide, placing: PlacingConfig, weights: Weights) -> Decision:
    """Decide for each side and choose among the readings."""
    priors = {side: placing.prior_of(side) for side in PERSPECTIVES}
    sides = sorted((s for s in priors if priors[s] >= LEAST_PRIOR), key=lambda s: -priors[s])
    decisions = {side: decide(replace(placing, perspective=side)) for side in sides}
    first = decisions[sides[0]]
    alike = {side: side == sides[0] or same_outcome(first.grounded, decisions[side].grounded) for side in sides}
    logs = np.array([np.log(priors[s] * FEASIBLE[decisions[s].grounded.status]) for s in sides])
    shares = np.exp(logs - logs.max()) / np.exp(logs - logs.max()).sum()
    readings = tuple(
        Reading(side, priors[side], float(share), outcome_of(decisions[side].grounded))
        for side, share in zip(sides, shares, strict=True)
    )
    if all(alike.values()):
        return replace(first, perspective=sides[0], readings=_marked(readings, sides[0]))
    best = sides[int(np.argmax(shares))]
    rest = max(float(p) for s, p in zip(sides, shares, strict=True) if s != best)
    if shares.max() >= weights.min_probability and shares.max() >= weights.min_odds * rest:
        refused = [f"{SIDE_WORDS[r.perspective]}: {r.outcome}" for r in readings if r.perspective != best]
        chosen = decisions[best]
        return replace(chosen, perspective=best, readings=_marked(readings, best), refused=(*chosen.refused, *refused))
    return _doubted(first, readings, sides)


def _doubted(decision: Decision, readings: Sequence[Reading], sides: Sequence[str]) -> Decision:
    grounded = replace(
        decision.grounded, status=Status.AMBIGUOUS, reason=f"Do you mean {' or '.join(SIDE_WORDS[s] for s in sides)}?"
    )
    return replace(decision, grounded=grounded, doubt=Doubt("perspective", tuple(sides)), readings=tuple(readings))


def _marked(readings: Sequence[Reading], side: str) -> tuple[Reading, ...]:
    return tuple(replace(r, chosen=r.perspective == side) for r in readings)


def same_outcome(first: GroundedCommand, second: GroundedCommand) -> bool:
    """Whether two decisions would do the same: same thing, same receiver or nearly the same place."""
    if first.status is not second.status or _id(first.object) != _id(second.object):
        return False
    if first.status is not Status.GROUNDED:
        return first.reason == second.reason
    if first.target.kind is not second.target.kind or _id(first.target.detection) != _id(second.target.detection):
        return False
    if first.target.pose is None or second.target.pose is None:
        return len(first.target.area) == len(second.target.area) and np.allclose(first.target.area, second.target.area)
    return bool(np.linalg.norm(first.target.pose[:3, 3] - second.target.pose[:3, 3]) <= SAME_PLACE_M)


def _id(detection: object) -> str:
    return str(getattr(detection, "id", ""))


def outcome_of(grounded: GroundedCommand) -> str:
    """Return in words what a reading would do."""
    if grounded.status is not Status.GROUNDED:
        return grounded.reason
    words = f"{grounded.object.label or 'thing'} ({grounded.object.id})" if grounded.object is not None else "nothing"
    if grounded.target.detection is not None:
        return f"{words} to {grounded.target.detection.id}"
    if grounded.target.pose is not None:
        x, y = grounded.target.pose[:2, 3]
        return f"{words} to {x:.2f}, {y:.2f}"
    return words
