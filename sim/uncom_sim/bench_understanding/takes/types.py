# SPDX-License-Identifier: Apache-2.0
"""Values of the benchmark: scenarios as written, takes as planned. Metres, seconds; the base_footprint frame."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

from uncom_common.primitive import Primitive

from uncom_sim.types import Meaning, Scene

SUBJECTS = ("object", "object_distractors", "target", "target_distractors", "clutter")


@dataclass(frozen=True, slots=True)
class Rivals:
    """Objects that could be taken for the one that is meant: "same" kind, "fruit", "vessel" or "any"; how many."""

    kind: str
    fewest: int
    most: int


@dataclass(frozen=True, slots=True)
class Cast:
    """Kinds of object and target with the words for them; a target of kind "" is a place."""

    object: str
    object_word: str
    target: str = ""
    target_word: str = ""


@dataclass(frozen=True, slots=True)
class Scenario:
    """One of the 22: what varies (the paper's subjects), and ways to say it."""

    id: int
    name: str
    takes: int
    row: int | None
    object: str
    target: str
    frames: tuple[str, ...]
    relations: dict[str, tuple[str, ...]]
    object_phrases: tuple[str, ...]
    target_phrases: tuple[str, ...]
    casts: tuple[Cast, ...]
    point: tuple[str, ...]
    action: str
    rivals: Rivals | None = None
    target_rivals: Rivals | None = None
    clutter: tuple[int, int] | None = None

    def subjects(self) -> dict[str, str]:
        """Return the variant of each subject of the paper's table."""
        return {
            "object": self.object,
            "object_distractors": "yes" if self.rivals is not None else "no",
            "target": self.target,
            "target_distractors": "yes" if self.target_rivals is not None else "no",
            "clutter": "yes" if self.clutter is not None else "no",
        }


@dataclass(frozen=True, slots=True)
class Conditions:
    """How the take is seen: brightness (1 is the usual room), camera noise (1 is the usual camera), exposure [s]."""

    light: float = 1.0
    camera_noise: float = 1.0
    exposure_s: float = 0.0


@dataclass(frozen=True, slots=True)
class TakePlan:
    """All that a take is made from; actions are the primitives that carry out what was said."""

    scenario: int
    index: int
    seed: int
    scene: Scene
    actions: tuple[Primitive, ...]
    conditions: Conditions
    world_seed: int
    manner: str = "plain"

    @property
    def name(self) -> str:
        """Short name: scenario, number, seed."""
        return f"s{self.scenario:02d}t{self.index:02d}seed{self.seed}"

    @property
    def meaning(self) -> Meaning:
        """What the person means.

        Raises:
            ValueError: the plan has none.
        """
        if self.scene.meaning is None:
            raise ValueError(f"{self.name} means nothing")
        return self.scene.meaning

    def as_dict(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        plain: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return plain

    def key(self, generator: str) -> str:
        """Return a name for the content made by a version of the generator: the same plan, the same take."""
        text = json.dumps([generator, self.as_dict()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:24]
