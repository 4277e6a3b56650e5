# SPDX-License-Identifier: Apache-2.0
"""Whose left and right: the robot's and the speaker's side are separate interpretations of the same words.

Each is decided by itself. If both would do the same, or one is clearly likelier by its prior, nothing is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from uncom_reasoner.config import PERSPECTIVES, PlacingConfig
from uncom_reasoner.grounding.options import PERSPECTIVE, PerspectiveOptions
from uncom_reasoner.types import Decision, Doubt, GroundedCommand, Interpretation, Status
from uncom_reasoner.weights import Weights

SIDE_WORDS = {"robot": "as I see it", "speaker": "as you see it"}

Decide = Callable[[PlacingConfig], Decision]


def decide_perspective(
    decide: Decide, placing: PlacingConfig, weights: Weights, options: PerspectiveOptions = PERSPECTIVE
) -> Decision:
    """Decide for each side and choose among the interpretations.

    Args:
        decide: decides with left and right as a side sees them.
        placing: with the side that is usually meant, and how likely that is.
        weights: the thresholds.
        options: of the likelihoods of the sides.
    """
    priors = {side: placing.prior_of(side) for side in PERSPECTIVES}
    sides = sorted((s for s in priors if priors[s] >= options.min_prior), key=lambda s: -priors[s])
    decisions = {side: decide(replace(placing, perspective=side)) for side in sides}
    first = decisions[sides[0]].grounded
    alike = all(same_outcome(first, decisions[side].grounded, options) for side in sides[1:])
    feasible = [_feasibility(decisions[side].grounded.status, options) for side in sides]
    logs = np.array([np.log(priors[side] * likelihood) for side, likelihood in zip(sides, feasible, strict=True)])
    shares = np.exp(logs - logs.max()) / np.exp(logs - logs.max()).sum()
    interpretations = tuple(
        Interpretation(side, priors[side], float(share), describe_outcome(decisions[side].grounded))
        for side, share in zip(sides, shares, strict=True)
    )
    if alike:
        marked = _mark_side(interpretations, sides[0])
        return replace(decisions[sides[0]], perspective=sides[0], interpretations=marked)
    best = sides[int(np.argmax(shares))]
    rest = max(float(p) for s, p in zip(sides, shares, strict=True) if s != best)
    if shares.max() >= weights.min_probability and shares.max() >= weights.min_odds * rest:
        refused = [f"{SIDE_WORDS[i.perspective]}: {i.outcome}" for i in interpretations if i.perspective != best]
        decision, marked = decisions[best], _mark_side(interpretations, best)
        return replace(decision, perspective=best, interpretations=marked, refused=(*decision.refused, *refused))
    return _doubt_sides(decisions[sides[0]], interpretations, sides)


def _feasibility(status: Status, options: PerspectiveOptions) -> float:
    """Return how likely a side is meant by which the command ends so."""
    if status is Status.GROUNDED:
        return 1.0
    return options.ambiguous_share if status is Status.AMBIGUOUS else options.infeasible_share


def _doubt_sides(decision: Decision, interpretations: tuple[Interpretation, ...], sides: Sequence[str]) -> Decision:
    reason = f"Do you mean {' or '.join(SIDE_WORDS[s] for s in sides)}?"
    grounded = replace(decision.grounded, status=Status.AMBIGUOUS, reason=reason)
    doubt = Doubt("perspective", tuple(sides))
    return replace(decision, grounded=grounded, doubt=doubt, interpretations=interpretations)


def _mark_side(interpretations: Sequence[Interpretation], side: str) -> tuple[Interpretation, ...]:
    return tuple(replace(i, chosen=i.perspective == side) for i in interpretations)


def same_outcome(first: GroundedCommand, second: GroundedCommand, options: PerspectiveOptions = PERSPECTIVE) -> bool:
    """Whether two decisions would do the same: same object, same receiver or nearly the same place."""
    if first.status is not second.status or _id(first.object) != _id(second.object):
        return False
    if first.status is not Status.GROUNDED:
        return first.reason == second.reason
    if first.target.kind is not second.target.kind or _id(first.target.detection) != _id(second.target.detection):
        return False
    if first.target.pose is None or second.target.pose is None:
        return len(first.target.area) == len(second.target.area) and np.allclose(first.target.area, second.target.area)
    return bool(np.linalg.norm(first.target.pose[:3, 3] - second.target.pose[:3, 3]) <= options.same_place_m)


def _id(detection: object) -> str:
    return str(getattr(detection, "id", ""))


def describe_outcome(grounded: GroundedCommand) -> str:
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
