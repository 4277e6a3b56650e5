# SPDX-License-Identifier: Apache-2.0
"""Values of deciding. Positions on the support are (2,) in plane coordinates (see support/support_plane.py)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum

import numpy as np
from shapely.geometry import Polygon
from uncom_common.camera import PinholeCamera
from uncom_common.primitive import Primitive
from uncom_common.transforms import FloatArray
from uncom_language.types import Command
from uncom_perception.types import Box, Detection, Scene, TableSurface

from uncom_reasoner.gesture_types import PhraseRay, RayObservation, TablePoint


class Status(IntEnum):
    """How a command ended; the constants of GroundedCommand.msg."""

    GROUNDED = 0
    FAILED = 1
    AMBIGUOUS = 2
    CANCELLED = 3


class TargetKind(IntEnum):
    """What the target is; the constants of GroundedTarget.msg."""

    NONE = 0
    OBJECT = 1
    AREA = 2


class Rule(str, Enum):
    """Why the likeliest candidate was taken."""

    CLEAR = "clear"  # its share and its odds pass the thresholds
    ANY = "any will do"  # the speaker left it open
    PLACE = "best place"  # places are all free: the one that fits best


@dataclass(frozen=True, slots=True)
class Factor:
    """One named log term of a candidate's probability."""

    name: str
    log: float


@dataclass(frozen=True, slots=True)
class Candidate:
    """One object ("d3"), place ("cell_7") or "none" that was weighed.

    The exponential of the sum of its factors, normalised over the candidates, is its probability (0 to 1).
    """

    id: str
    label: str
    factors: tuple[Factor, ...]
    probability: float
    box: Box | None = None
    chosen: bool = False

    @property
    def log(self) -> float:
        """Sum of the log factors."""
        return sum(factor.log for factor in self.factors)


@dataclass(frozen=True, slots=True)
class View:
    """The camera that saw the scene: intrinsics and transform_camera_to_scene (4, 4); either may be unknown."""

    camera: PinholeCamera | None = None
    transform_camera_to_scene: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Cell:
    """One Voronoi cell of the support: outline (N, 2), centre (2,), and what occupies it ("" is free)."""

    id: str
    polygon: FloatArray
    centre: FloatArray
    occupied_by: str = ""


@dataclass(frozen=True, slots=True)
class GroundedTarget:
    """Where the moved object is to end: pose (4, 4) of its footprint's centre on the support, and outline (N, 3) [m].

    Both are in the scene's frame. Without depth the pose is None and the area is in pixels with z 0.
    """

    kind: TargetKind = TargetKind.NONE
    detection: Detection | None = None
    pose: FloatArray | None = None
    area: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True, slots=True)
class Choice:
    """The outcome of weighing the candidates of one part of a command: the id that was taken, and why."""

    candidates: tuple[Candidate, ...]
    chosen: str
    probability: float
    rule: Rule = Rule.CLEAR


@dataclass(frozen=True, slots=True)
class Given:
    """What is settled already when a part is weighed; parts are "object", "target", "anchor", "reference2".

    Attributes:
        among: the ids of what a part can be after an answer; with one id it is that object.
        excluded: ids of what a part is not ("no, not this one").
        perspective: whose left and right was meant, once that was answered; "" if it was not.
        start: where on the support (2,) the object is about to be, for "a bit to the left"; None: where it is.
        moved: outlines on the support of objects of a group that are put somewhere before; an empty one is in another
            object.
    """

    among: Mapping[str, frozenset[str]] = field(default_factory=dict)
    excluded: Mapping[str, frozenset[str]] = field(default_factory=dict)
    perspective: str = ""
    moved: Mapping[str, Polygon] = field(default_factory=dict)
    start: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that a decision rests on.

    Attributes:
        command: what was said.
        scene: what was detected.
        phrases: that the scene's scores are for.
        view: the camera that saw the scene.
        rays: of the hands around the words.
        object_frame_s, target_frame_s: stamps of the images of when object and target were spoken of [s].
        given: what is settled already.
        notes: about what was looked at, for the explanation.
    """

    command: Command
    scene: Scene
    phrases: tuple[str, ...]
    view: View
    rays: tuple[RayObservation, ...] = ()
    object_frame_s: float = 0.0
    target_frame_s: float = 0.0
    given: Given = field(default_factory=Given)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class GroundedCommand:
    """A command with its objects and places found; the fields are those of GroundedCommand.msg, explained there."""

    stamp_s: float
    frame_id: str
    utterance_id: str
    index: int
    status: Status
    reason: str = ""
    object_text: str = ""
    action_text: str = ""
    target_text: str = ""
    primitive: Primitive = Primitive.NONE
    relation: str = "none"
    object: Detection | None = None
    object_probability: float = 0.0
    target: GroundedTarget = field(default_factory=GroundedTarget)
    target_probability: float = 0.0
    scene: tuple[Detection, ...] = ()
    table: TableSurface | None = None
    object_candidates: tuple[Candidate, ...] = ()
    target_candidates: tuple[Candidate, ...] = ()
    object_frame_s: float = 0.0
    target_frame_s: float = 0.0
    backends: tuple[str, ...] = ()
    latency_s: float = 0.0
    part: int = 0
    parts: int = 1


@dataclass(frozen=True, slots=True)
class Doubt:
    """Why a command is ambiguous: the part, and the ids of what is too close to choose from.

    For the part "perspective" the choices are the sides that left and right may be meant from.
    """

    part: str
    choices: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """What would have been likeliest for a part ("object", "target") without one source ("gesture", "words")."""

    without: str
    part: str
    likeliest: str
    probability: float


@dataclass(frozen=True, slots=True)
class Interpretation:
    """One way to take left and right: whose, its prior, its probability, and what would be done."""

    perspective: str
    prior: float
    probability: float
    outcome: str
    chosen: bool = False


@dataclass(frozen=True, slots=True)
class Decision:
    """A grounded command with what explains it.

    Attributes:
        grounded: the outcome.
        object_ray, target_ray: gestures of object and target.
        target_point: where the target's gesture meets the support.
        cells: the occupancy map.
        reference: the object that the target's place is relative to; `second` is the other one of "between A and B".
        outline: the support's (N, 2) in plane coordinates; metric tells whether those are metres (else pixels).
        refused: interpretations that were weighed and not taken.
        notes: of the evidence and of the parser.
        counterfactuals: what would have been likeliest without one source.
        doubt: why it is ambiguous, if it is.
        rules: why the candidates of the parts that were settled were taken.
        perspective: the side that left and right were taken from; "" where nothing hangs on it.
        interpretations: the sides that were weighed.
        place: (2,) where the moved object's centre goes, plane coordinates.
        group: what was weighed for a reference to several objects.
    """

    grounded: GroundedCommand
    object_ray: PhraseRay | None = None
    target_ray: PhraseRay | None = None
    target_point: TablePoint | None = None
    cells: tuple[Cell, ...] = ()
    reference: Choice | None = None
    outline: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    metric: bool = True
    refused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    counterfactuals: tuple[Counterfactual, ...] = ()
    doubt: Doubt | None = None
    second: Choice | None = None
    rules: Mapping[str, Rule] = field(default_factory=dict)
    perspective: str = ""
    interpretations: tuple[Interpretation, ...] = ()
    place: FloatArray | None = None
    group: tuple[Candidate, ...] = ()
