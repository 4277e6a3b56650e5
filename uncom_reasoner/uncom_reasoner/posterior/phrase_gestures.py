# SPDX-License-Identifier: Apache-2.0
"""The gesture of a reference, and how far objects are from it."""

from __future__ import annotations

from collections.abc import Sequence

from uncom_language.types import Reference, Span
from uncom_perception.types import Detection

from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.pointing.pointing_likelihood import PointingError, pointing_error
from uncom_reasoner.pointing.ray_fusion import assign_dwells, phrase_span
from uncom_reasoner.posterior.context import Context


def find_gesture(role: str, reference: Reference, context: Context, other_spans: Sequence[Span] = ()) -> PhraseRay:
    """Return the gesture of a reference: the hands' dwells around its words.

    A gesture that goes with a pointing word of the locating phrase ("the cup next to this bottle") is not its own.
    """
    span = phrase_span(reference)
    inner = [r for r in (reference.anchor, reference.compared_to) if r is not None and r.deictic]
    if inner and not reference.deictic:
        return PhraseRay(role, span.start_s, span.end_s)
    return assign_dwells(role, span, context.dwells, context.weights, other_spans)


def find_anchor_gesture(anchor: Reference, context: Context) -> PhraseRay:
    """Return the gesture of an object that only locates another: one only if it has a pointing word."""
    if anchor.deictic:
        return find_gesture("anchor", anchor, context)
    return PhraseRay("anchor", anchor.span.start_s, anchor.span.end_s)


def pointing_errors(ray: PhraseRay, detection: Detection, context: Context) -> dict[int, PointingError]:
    """Return the pointing error of an object for each dwell of a gesture, by the dwell's index."""
    return {i: pointing_error(dwell, detection, context.weights) for i, (dwell, _) in enumerate(ray.dwells)}


def main_dwell_z(ray: PhraseRay, detection: Detection, context: Context) -> float:
    """Return the error [standard deviations] of an object from the gesture's main dwell; infinite without one."""
    if not ray.present:
        return float("inf")
    main = max(range(len(ray.dwells)), key=lambda i: ray.dwells[i][1])
    return pointing_errors(ray, detection, context)[main].z
