# SPDX-License-Identifier: Apache-2.0
"""One command on its way through the reasoner, and when it has what it needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from uncom_language.types import Command, Reference, Span
from uncom_perception.types import Scene

from uncom_reasoner.detector_phrases import is_bare, is_place_word
from uncom_reasoner.pointing.ray_fusion import dwells_of, phrase_ray, phrase_span
from uncom_reasoner.types import Given, RayObservation
from uncom_reasoner.weights import Weights

SETTLED_WEIGHT = 2.0  # a gesture with so many frames' weight needs no more of them
MAIN_SHARE = 0.6
SETTLED_S = 0.25  # hands known so long after the words are enough where gestures are there already
BEHIND_S = 0.1  # of the words: how far hands may be behind where no gesture is needed


class Stage(Enum):
    """Where a command is."""

    LOOKING = "looking"  # for an image to detect things in
    DETECTING = "detecting"
    WAITING = "waiting"  # for hands up to the end of its words
    DECIDING = "deciding"


@dataclass
class Job:
    """A command being grounded; wall times are of a steady clock [s], `frame` is the image's message."""

    command: Command
    received_s: float
    received_wall_s: float
    given: Given = field(default_factory=Given)
    asked: int = 0  # questions so far
    stage: Stage = Stage.LOOKING
    asked_wall_s: float = 0.0  # when the detector was asked
    scene_s: float = 0.0
    with_hand: bool = False
    phrases: tuple[str, ...] = ()
    scene: Scene | None = None
    until_s: float = float("inf")  # hands after this time are not used
    timings_s: dict[str, float] = field(default_factory=dict)


def words_span(command: Command) -> Span:
    """Return the time from the first to the last word of a command's parts."""
    spans = [r.span for r in (command.object, command.target, command.reference2) if r is not None]
    if command.action_span is not None:
        spans.append(command.action_span)
    if not spans:
        return Span(0.0, 0.0)
    return Span(min(s.start_s for s in spans), max(s.end_s for s in spans))


def object_end(command: Command) -> float:
    """Return when the object was spoken of: the object frame (paper, section III-D)."""
    return command.object.span.end_s if command.object is not None else words_span(command).end_s


def target_end(command: Command) -> float:
    """Return when the target was spoken of: the target frame (paper, section III-D)."""
    return command.target.span.end_s if command.target is not None else words_span(command).end_s


def deictic_parts(command: Command) -> dict[str, Reference]:
    """Return the parts that need a gesture: "this", "this bowl", "here"."""
    parts = {"object": command.object, "target": command.target, "reference2": command.reference2}
    return {
        name: r
        for name, r in parts.items()
        if r is not None and (r.deictic or is_place_word(r) or (is_bare(r) and not r.anaphoric and not r.other))
    }


def gestures_complete(
    command: Command, rays: Sequence[RayObservation], latest_s: float, late_s: float, weights: Weights
) -> bool:
    """Whether the hands seen up to latest_s [s] are enough to decide on a command.

    Without a pointing word, hands up to the last word are; with one, its gesture must be there, or late_s have passed.
    """
    end = words_span(command).end_s
    if latest_s >= end + late_s:
        return True
    parts = deictic_parts(command)
    if not parts:
        return latest_s >= end - BEHIND_S
    if latest_s < end + min(SETTLED_S, late_s):
        return False
    dwells = dwells_of(rays, weights)
    spoken = {"object": command.object, "target": command.target, "reference2": command.reference2}
    spans = {name: phrase_span(r) for name, r in spoken.items() if r is not None}
    for name in parts:
        span = spans[name]
        others = [other for key, other in spans.items() if key != name and other != span]
        ray = phrase_ray(name, span, dwells, weights, others)
        # A look that was over before the word began may be about the words before; a later one may still come.
        there = [dwell for dwell, share in ray.dwells if share >= MAIN_SHARE and dwell.stamps_s[-1] >= span.start_s]
        if ray.weight < SETTLED_WEIGHT or not there:
            return False
    return True


def hands_until(
    command: Command,
    stamps_s: Sequence[float],
    rays: Sequence[RayObservation],
    late_s: float,
    weights: Weights,
) -> float | None:
    """Return the time [s] of the first image whose hands complete what a command needs; None while there is none.

    What comes later is not used, so that the decision does not depend on how fast anything ran.

    Args:
        command: with the times of its words.
        stamps_s: of the images in which hands were looked for, in order.
        rays: of the hands in them.
        late_s: how long to wait for a late gesture.
        weights: of the gestures.
    """
    end = words_span(command).end_s
    for stamp in stamps_s:
        if stamp >= end - BEHIND_S:
            seen = [ray for ray in rays if ray.stamp_s <= stamp]
            if gestures_complete(command, seen, stamp, late_s, weights):
                return stamp
    return None


def out_of_time(job: Job, now_s: float, wall_s: float, late_s: float, limit_s: float) -> bool:
    """Whether hands and images were waited for long enough.

    The limit counts on the clock of the stamps, and (three times as long) on the wall, should that clock stand still.
    """
    needed = words_span(job.command).end_s + late_s
    return now_s >= max(needed, job.received_s) + limit_s or wall_s >= job.received_wall_s + 3.0 * limit_s
