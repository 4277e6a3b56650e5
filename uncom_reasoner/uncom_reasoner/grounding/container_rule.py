# SPDX-License-Identifier: Apache-2.0
"""The container rule (paper, section III-H): which objects are containers, and when a target means one.

* An object is a container if its detector score for "container" is near the best one's (`is_container`).
* "Put X in Y": the parser makes that the primitive PUT_IN, and Y is then taken as it is named; here only is checked
  that X fits into Y's opening (`put_into`).
* "Here", "there": a container that the finger squarely points into is what is meant; else a free place
  (`find_pointed_container`; used by target_resolution.py).
* "Put it here" with the finger on an object: into it where it is hollow, else onto it (`put_into`).
"""

from __future__ import annotations

from shapely.geometry import Point
from uncom_common.primitive import Primitive
from uncom_language.types import Command
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import CONTAINER
from uncom_reasoner.exceptions import NoPlaceError
from uncom_reasoner.gesture_types import PhraseRay, TablePoint
from uncom_reasoner.grounding.options import CONTAINERS, ContainerOptions
from uncom_reasoner.grounding.place_resolution import TargetResult, pose_on_support
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.phrase_gestures import main_dwell_z
from uncom_reasoner.support.receptacle import find_opening, find_receiving_outline, fits_in
from uncom_reasoner.types import Choice, GroundedTarget, TargetKind


def is_container(detection_id: str, context: Context, options: ContainerOptions = CONTAINERS) -> bool:
    """Whether an object is a container: by its score for that word beside those of the others."""
    scores, _ = context.scores(CONTAINER)
    own = next(s for d, s in zip(context.detections, scores, strict=True) if d.id == detection_id)
    return own >= max(options.min_score, options.min_share * max(scores))


def find_pointed_container(
    moved: Detection,
    ray: PhraseRay,
    point: TablePoint | None,
    context: Context,
    options: ContainerOptions = CONTAINERS,
) -> str:
    """Return the id of the container that a gesture squarely points into, "" if there is none.

    Args:
        moved: what is to be put there.
        ray: the gesture.
        point: where it meets the support, if it does.
        context: of the decision; `Weights.under_ray_z` says what is square.
        options: what is a container, and how near the point must be.
    """
    margin = options.hit_margin_m * context.surface.units_per_m
    pointed = []
    for detection in context.detections:
        if detection.id == moved.id or not is_container(detection.id, context, options):
            continue
        shape = context.footprints[detection.id]
        is_hit = point is None or shape.is_empty or shape.buffer(margin).contains(Point(*point.mean))
        z = main_dwell_z(ray, detection, context)
        if z <= context.weights.under_ray_z and is_hit:
            pointed.append((z, detection.id))
    return min(pointed)[1] if pointed else ""


def put_into(
    command: Command,
    moved: Detection,
    choice: Choice,
    point: TablePoint | None,
    context: Context,
    options: ContainerOptions = CONTAINERS,
) -> TargetResult:
    """Return the target in or on the object that was chosen.

    Raises:
        NoPlaceError: the moved object does not fit into it.
    """
    receiver = context.detection(choice.chosen)
    if command.primitive is Primitive.PUT_IN and not fits_in(moved, receiver, context.surface):
        raise NoPlaceError(f"The {moved.label or 'thing'} does not fit in the {receiver.label or 'container'}.")
    opening = find_opening(receiver, context.surface)
    outline = find_receiving_outline(receiver, context.surface)
    pose, area = pose_on_support(opening.centre, opening.height, outline, moved, context)
    target = GroundedTarget(TargetKind.OBJECT, receiver, pose, area)
    primitive = command.primitive
    if primitive is Primitive.PLACE:  # "put it here" and the finger was on an object
        is_hollow = opening.depth > options.hollow_m * context.surface.units_per_m
        primitive = Primitive.PUT_IN if is_hollow else Primitive.PUT_ON
    return TargetResult(target, choice, point, primitive=primitive)
