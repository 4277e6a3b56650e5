# SPDX-License-Identifier: Apache-2.0
"""The paper's rules as published, as another way to decide on the same words, hands and detections.

One frame at the end of each phrase, or one up to 0.03 s away (section III-D); landmarks 5 to 8 of the hand whose
fingertip is nearest in z (III-E); of several objects the one whose box centre is nearest to the infinite line through
the finger; places are the centres of Voronoi cells of uniform random seeds on the box of the table, of which those
with an object or the reference in them are taken (III-F). What it says of no case is decided in the plainest way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from uncom_common.transforms import apply
from uncom_language.types import Reference, Relation
from uncom_perception.types import Detection, HandsFrame
from uncom_reasoner.detector_phrases import (
    CONTAINER,
    OBJECTS,
    detector_phrase,
    is_bare,
    is_place_word,
    resolve_antecedent,
)
from uncom_reasoner.grounding.decision import failed_command
from uncom_reasoner.types import Evidence, GroundedCommand, GroundedTarget, Status, TargetKind

from uncom_sim.bench_understanding.judging.options import PAPER_RULES, PaperRuleOptions
from uncom_sim.person.hand_model import HandLandmark

FloatArray = npt.NDArray[np.float64]

_BESIDE = {
    Relation.LEFT_OF: (-1.0, 0.0),
    Relation.RIGHT_OF: (1.0, 0.0),
    Relation.IN_FRONT_OF: (0.0, 1.0),
    Relation.BEHIND: (0.0, -1.0),
}
_AREAS = (*_BESIDE, Relation.NEXT_TO, Relation.NEAR, Relation.BETWEEN)


@dataclass(frozen=True, slots=True)
class Line:
    """A finger in one image: base (2,) and tip (2,) [px]; its line has no end on either side."""

    base: FloatArray
    tip: FloatArray

    def distance(self, points: FloatArray) -> FloatArray:
        """Return the distances (N,) of points (N, 2) from the infinite line [px]."""
        along = self.tip - self.base
        away = points - self.tip
        return np.asarray(np.abs(along[0] * away[:, 1] - along[1] * away[:, 0]) / max(float(np.hypot(*along)), 1e-9))


def decide_as_published(
    evidence: Evidence, hands: Sequence[HandsFrame], *, options: PaperRuleOptions = PAPER_RULES
) -> GroundedCommand:
    """Ground a command by the paper's rules; no hand is no gesture."""
    command = evidence.command
    if command.object is None:
        return failed_command(command, "no object was named")
    obj = _choose_object(
        command.object,
        pointing_line(hands, command.object.span.end_s, options=options),
        evidence,
        frozenset(),
        options=options,
    )
    if obj is None:
        return failed_command(command, "the object was not found")
    target = GroundedTarget()
    if command.target is not None:
        found = _choose_target(
            command.target,
            pointing_line(hands, command.target.span.end_s, options=options),
            evidence,
            obj,
            options=options,
        )
        if found is None:
            return failed_command(command, "the target was not found")
        target = found
    return GroundedCommand(
        stamp_s=evidence.scene.stamp_s,
        frame_id=evidence.scene.frame_id,
        utterance_id=command.utterance_id,
        index=command.index,
        status=Status.GROUNDED,
        primitive=command.primitive,
        relation=command.relation.value,
        object=obj,
        target=target,
        table=evidence.scene.table,
    )


def pointing_line(hands: Sequence[HandsFrame], end_s: float, *, options: PaperRuleOptions = PAPER_RULES) -> Line | None:
    """Return the finger in the frame at a time, or in the nearest frame of another time up to 0.03 s away."""
    offsets = [0.0] + [sign * options.retry_s * k / 3 for k in range(1, 4) for sign in (-1.0, 1.0)]
    for offset in offsets:
        frame = min(hands, key=lambda f: abs(f.stamp_s - end_s - offset), default=None)
        if frame is not None and frame.hands:
            marks = min((hand.landmarks for hand in frame.hands), key=lambda m: float(m[HandLandmark.INDEX_TIP, 2]))
            return Line(
                marks[HandLandmark.INDEX_BASE, :2].astype(float), marks[HandLandmark.INDEX_TIP, :2].astype(float)
            )
    return None


def _choose_object(
    reference: Reference,
    line: Line | None,
    evidence: Evidence,
    without: frozenset[str],
    phrase: str | None = None,
    *,
    options: PaperRuleOptions = PAPER_RULES,
) -> Detection | None:
    """Return the object that a phrase names; of several, the one nearest to the line."""
    wanted = phrase or (
        OBJECTS if is_bare(reference) else detector_phrase(reference, resolve_antecedent(evidence.command))
    )
    if wanted not in evidence.phrases:
        return None
    number = evidence.phrases.index(wanted)
    objects = [d for d in evidence.scene.detections if d.id not in without]
    hits = [d for d in objects if wanted == OBJECTS or d.phrase_scores[number] >= options.least_score]
    if len(hits) <= 1 or line is None:
        return max(hits, key=lambda d: d.phrase_scores[number], default=None)
    away = line.distance(np.array([d.box.center for d in hits]))
    return hits[int(np.argmin(away))]


def _choose_target(
    reference: Reference,
    line: Line | None,
    evidence: Evidence,
    obj: Detection,
    *,
    options: PaperRuleOptions = PAPER_RULES,
) -> GroundedTarget | None:
    taken = frozenset((obj.id,))
    if evidence.command.relation in _AREAS:
        anchor = _choose_object(reference, line, evidence, taken, options=options)
        return None if anchor is None else _area(evidence, _beside_cells(evidence, anchor, options=options))
    if not (is_bare(reference) or is_place_word(reference)):
        found = _choose_object(reference, line, evidence, taken, options=options)
        return None if found is None else GroundedTarget(TargetKind.OBJECT, found)
    container = _choose_object(reference, line, evidence, taken, CONTAINER, options=options)
    if container is not None:
        return GroundedTarget(TargetKind.OBJECT, container)
    if line is None:
        return None
    centres = _free_cells(evidence, (), options=options)
    if len(centres) == 0:
        return None
    # "closest to the gesture": on the line, as near to the fingertip as may be
    away = line.distance(centres) + 0.25 * np.linalg.norm(centres - line.tip, axis=1)
    return _area(evidence, centres[np.argsort(away)])


def _beside_cells(evidence: Evidence, anchor: Detection, *, options: PaperRuleOptions = PAPER_RULES) -> FloatArray:
    """Return free cells (N, 2) [px] in the direction of the relation, the nearest first."""
    middle = np.array(anchor.box.center)
    centres = _free_cells(evidence, (anchor.box.center,), options=options)
    offsets = centres - middle
    way = _BESIDE.get(evidence.command.relation)
    if way is not None:
        forward = offsets @ np.array(way)
        sideways = np.abs(offsets @ np.array([way[1], way[0]]))
        keep = forward > sideways
        centres, offsets = centres[keep], offsets[keep]
    return np.asarray(centres[np.argsort(np.linalg.norm(offsets, axis=1))])


def _free_cells(
    evidence: Evidence, also: Sequence[tuple[float, float]], *, options: PaperRuleOptions = PAPER_RULES
) -> FloatArray:
    """Return the seeds (N, 2) [px] of cells without the centre of any object and without the reference point."""
    if evidence.scene.table is None:
        return np.zeros((0, 2))
    outline = evidence.scene.table.image_polygon
    low, high = outline.min(axis=0), outline.max(axis=0)
    seeds = np.random.default_rng(options.seed).uniform(low, high, (options.cells, 2))
    marks = np.array([*(d.box.center for d in evidence.scene.detections), *also])
    if len(marks) == 0:
        return seeds
    owner = np.argmin(np.linalg.norm(marks[:, None] - seeds[None], axis=2), axis=1)
    free = np.ones(len(seeds), bool)
    free[owner] = False
    return np.asarray(seeds[free])


def _area(evidence: Evidence, centres: FloatArray) -> GroundedTarget | None:
    """Return the first cell as a place on the table: where its pixel's ray meets the surface."""
    table, view = evidence.scene.table, evidence.view
    if len(centres) == 0 or table is None or view.camera is None or view.transform_camera_to_scene is None:
        return None
    camera, pose = view.camera, view.transform_camera_to_scene
    u, v = centres[0]
    toward = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
    start, end = apply(pose, np.zeros(3)), apply(pose, toward)
    way = end - start
    share = float((table.height_m - start[2]) / way[2])
    placed = np.eye(4)
    placed[:3, 3] = start + share * way
    return GroundedTarget(TargetKind.AREA, None, placed)
