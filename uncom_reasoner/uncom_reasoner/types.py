# SPDX-License-Identifier: Apache-2.0
"""Values of deciding. Positions on the support are (2,) in plane coordinates (see surface.py)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon
from uncom_common.camera import PinholeCamera
from uncom_common.primitive import Primitive
from uncom_language.types import Command
from uncom_perception.types import Box, Detection, Scene, TableSurface

FloatArray = npt.NDArray[np.float64]


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
    """One thing ("d3"), place ("cell_7") or "none" that was weighed.

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
class RayInSpace:
    """A pointing ray in the scene frame [m]: fingertip, unit direction, and the camera's centre, each (3,)."""

    tip: FloatArray
    direction: FloatArray
    eye: FloatArray


@dataclass(frozen=True, slots=True)
class RayObservation:
    """The ray of one hand in one image: in pixels always, in space if its depth is known."""

    stamp_s: float
    hand: str
    score: float
    sigma_rad: float
    width: int
    tip_px: FloatArray
    base_px: FloatArray
    direction_px: FloatArray
    space: RayInSpace | None = None


@dataclass(frozen=True, slots=True)
class Dwell:
    """A stretch of time in which a hand pointed one way, its rays fused; stillness (N,) weighs its frames."""

    hand: str
    stamps_s: tuple[float, ...]
    stillness: tuple[float, ...]
    sigma_rad: float
    width: int
    finger_px: float
    tip_px: FloatArray
    direction_px: FloatArray
    space: RayInSpace | None = None


@dataclass(frozen=True, slots=True)
class PhraseRay:
    """The gesture of one phrase: dwells with their shares (summing to 1), and the frames' weight behind them."""

    role: str
    start_s: float
    end_s: float
    dwells: tuple[tuple[Dwell, float], ...] = ()
    weight: float = 0.0

    @property
    def present(self) -> bool:
        """Whether there is a gesture for the phrase."""
        return bool(self.dwells)


@dataclass(frozen=True, slots=True)
class TablePoint:
    """Where a gesture meets the support: mean (2,) and covariance (2, 2) in plane coordinates."""

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, slots=True)
class Cell:
    """One Voronoi cell of the support: outline (N, 2), centre (2,), and what occupies it ("" is free)."""

    id: str
    polygon: FloatArray
    centre: FloatArray
    occupied_by: str = ""


@dataclass(frozen=True, slots=True)
class GroundedTarget:
    """Where the moved thing is to end: pose (4, 4) of its footprint's centre on the support, and outline (N, 3) [m].

    Both are in the scene's frame. Without depth the pose is None and the area is in pixels with z 0.
    """

    kind: TargetKind = TargetKind.NONE
    detection: Detection | None = None
    pose: FloatArray | None = None
    area: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True, slots=True)
class Choice:
    """The outcome of weighing the candidates of one part of a command."""

    candidates: tuple[Candidate, ...]
    chosen: str
    probability: float
    rule: Rule = Rule.CLEAR


@dataclass(frozen=True, slots=True)
class Given:
    """What is settled already when a part is weighed; parts are "object", "target", "anchor", "reference2".

    Attributes:
        among: the things that a part can be after an answer; with one id it is that thing.
        excluded: things that a part is not ("no, not this one").
        perspective: whose left and right was meant, once that was answered; "" if it was not.
        start: where on the support (2,) the thing is about to be, for "a bit to the left"; None: where it is.
        moved: outlines on the support of things of a group that are put somewhere before; an empty one is in a thing.
    """

    among: Mapping[str, frozenset[str]] = field(default_factory=dict)
    excluded: Mapping[str, frozenset[str]] = field(default_factory=dict)
    perspective: str = ""
    moved: Mapping[str, Polygon] = field(default_factory=dict)
    start: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that a decision rests on. `phrases` are those the scene's scores are for."""

    command: Command
    scene: Scene
    phrases: tuple[str, ...]
    view: View
    rays: tuple[RayObservation, ...] = ()
    object_frame_s: float = 0.0
    target_frame_s: float = 0.0
    given: Given = field(default_factory=Given)
    notes: tuple[str, ...] = ()  # about what was looked at, for the explanation


@dataclass(frozen=True, slots=True)
class GroundedCommand:
    """A command with its things and places found; the fields of GroundedCommand.msg."""

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
    """A grounded command with what explains it: the gestures, the occupancy map and the reasons.

    outline is the support's (N, 2) in plane coordinates; metric tells whether those are metres (else pixels).
    `refused` are readings that were weighed and not taken.
    """

    grounded: GroundedCommand
    object_ray: PhraseRay | None = None
    target_ray: PhraseRay | None = None
    target_point: TablePoint | None = None
    cells: tuple[Cell, ...] = ()
    reference: Choice | None = None  # the thing that the target's place is relative to
    outline: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    metric: bool = True
    refused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    counterfactuals: tuple[Counterfactual, ...] = ()
    doubt: Doubt | None = None
    second: Choice | None = None  # the other thing of "between A and B"
    rules: Mapping[str, Rule] = field(default_factory=dict)  # of the parts that were settled
    perspective: str = ""  # the side that left and right were taken from; "" where nothing hangs on it
    interpretations: tuple[Interpretation, ...] = ()
    place: FloatArray | None = None  # (2,) where the moved thing's centre goes, plane coordinates
    group: tuple[Candidate, ...] = ()  # what was weighed for a reference to several things
