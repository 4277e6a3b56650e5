# SPDX-License-Identifier: Apache-2.0
"""How long hands are waited for: when the gestures that a command's words need have been seen.

A pointing that comes late counts as long as hands are waited for: until `late_pointing_s` (a parameter of the reasoner
node) after the last word, or shorter where every pointing word has its gesture before (`gestures_complete`).
"""

from __future__ import annotations

from collections.abc import Sequence

from uncom_language.types import Command, Reference, Span

from uncom_reasoner.detector_phrases import is_bare, is_place_word
from uncom_reasoner.evidence.options import GESTURE_TIMING, GestureTimingOptions
from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.pointing.ray_fusion import assign_dwells, phrase_span, segment_dwells
from uncom_reasoner.weights import Weights


def words_span(command: Command) -> Span:
    """Return the time [s] from the first to the last word of a command's parts; zeros where it has none."""
    spans = [r.span for r in _parts(command).values()]
    if command.action_span is not None:
        spans.append(command.action_span)
    if not spans:
        return Span(0.0, 0.0)
    return Span(min(s.start_s for s in spans), max(s.end_s for s in spans))


def object_end_s(command: Command) -> float:
    """Return when [s] the object was spoken of: the time of the object frame (paper, section III-D)."""
    return command.object.span.end_s if command.object is not None else words_span(command).end_s


def target_end_s(command: Command) -> float:
    """Return when [s] the target was spoken of: the time of the target frame (paper, section III-D)."""
    return command.target.span.end_s if command.target is not None else words_span(command).end_s


def deictic_parts(command: Command) -> dict[str, Reference]:
    """Return the parts by name that need a gesture: "this", "this bowl", "here"."""
    return {
        name: r
        for name, r in _parts(command).items()
        if r.deictic or is_place_word(r) or (is_bare(r) and not r.anaphoric and not r.other)
    }


def _parts(command: Command) -> dict[str, Reference]:
    parts = {"object": command.object, "target": command.target, "reference2": command.reference2}
    return {name: reference for name, reference in parts.items() if reference is not None}


def gestures_complete(
    command: Command,
    rays: Sequence[RayObservation],
    latest_s: float,
    late_s: float,
    weights: Weights,
    options: GestureTimingOptions = GESTURE_TIMING,
) -> bool:
    """Whether the hands seen up to latest_s [s] are enough to decide on a command.

    Without a pointing word, hands up to the last word are; with one, its gesture must be there, or late_s [s] have
    passed since the last word.
    """
    end_s = words_span(command).end_s
    if latest_s >= end_s + late_s:
        return True
    deictic = deictic_parts(command)
    if not deictic:
        return latest_s >= end_s - options.named_lead_s
    if latest_s < end_s + min(options.settling_s, late_s):
        return False
    dwells = segment_dwells(rays, weights)
    spans = {name: phrase_span(r) for name, r in _parts(command).items()}
    for name in deictic:
        span = spans[name]
        other_spans = [other for key, other in spans.items() if key != name and other != span]
        ray = assign_dwells(name, span, dwells, weights, other_spans)
        # A dwell that was over before the word began may be about the words before; a later one may still come.
        current = [
            dwell
            for dwell, share in ray.dwells
            if share >= options.dominant_share and dwell.stamps_s[-1] >= span.start_s
        ]
        if ray.weight < options.sufficient_weight or not current:
            return False
    return True


def gestures_complete_at_s(
    command: Command,
    stamps_s: Sequence[float],
    rays: Sequence[RayObservation],
    late_s: float,
    weights: Weights,
    options: GestureTimingOptions = GESTURE_TIMING,
) -> float | None:
    """Return the time [s] of the first image whose hands complete what a command needs; None while there is none.

    What comes later is not used, so that the decision does not depend on how fast anything ran.

    Args:
        command: with the times of its words.
        stamps_s: of the images in which hands were looked for, in order.
        rays: of the hands in them.
        late_s: how long a late gesture is waited for after the last word [s].
        weights: of the gestures.
        options: what counts as enough.
    """
    end_s = words_span(command).end_s
    for stamp_s in stamps_s:
        if stamp_s >= end_s - options.named_lead_s:
            seen = [ray for ray in rays if ray.stamp_s <= stamp_s]
            if gestures_complete(command, seen, stamp_s, late_s, weights, options):
                return stamp_s
    return None
