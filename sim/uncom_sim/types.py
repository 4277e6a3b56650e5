# SPDX-License-Identifier: Apache-2.0
"""Values of the simulated world. Metres, radians, seconds; places are in base_footprint of the robot's start."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Point2 = tuple[float, float]

SIDES = ("far", "left", "right")
HANDS = ("left", "right")
# Unit vectors of the relations of side in base_footprint (REP 103), as the robot sees them.
DIRECTIONS: dict[str, Point2] = {
    "left_of": (0.0, 1.0),
    "right_of": (0.0, -1.0),
    "in_front_of": (-1.0, 0.0),
    "behind": (1.0, 0.0),
}
# Lengths [m], speeds and differences below this are none: rounding, not measurement.
NEGLIGIBLE = 1e-6
SAMPLE_RATE_HZ = 16000  # of voice, microphone and takes
RELATIONS = ("in", "on", "left_of", "right_of", "in_front_of", "behind", "next_to", "area", "none")


@dataclass(frozen=True, slots=True)
class Table:
    """The table top: ranges on the floor plan and height of the surface [m]."""

    x_min: float = 0.45
    x_max: float = 0.95
    y_min: float = -0.5
    y_max: float = 0.5
    height: float = 0.72

    def contains(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Whether a place is on the table, at least margin [m] from its edge."""
        return self.x_min + margin <= x <= self.x_max - margin and self.y_min + margin <= y <= self.y_max - margin


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One object as it is to be put on the table: yaw is about the vertical, 0 with the object's x axis ahead."""

    id: str
    kind: str
    colour: str
    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class PersonOptions:
    """How the simulated person looks, speaks and points; None lets the seed choose.

    skin is a tone from 0 (light) to 1 (dark); size scales the hand (1 = 19 cm); speed is in words per minute; pitch is
    eSpeak's (0 to 99); lead and lag say how long before and after the words the finger stays on the object [s], a lead
    below 0 is a finger that comes late; waver is how far an unsteady hand sways about its place [m];
    noise is the level of background noise relative to speech (0 = silent room, 0.1 = 20 dB below the voice), reverb the
    level of the room's echo relative to the direct sound.
    """

    side: str | None = None
    hand: str | None = None
    skin: float | None = None
    size: float | None = None
    voice: str | None = None
    speed: float | None = None
    pitch: float | None = None
    lead: float | None = None
    lag: float | None = None
    noise: float | None = None
    reverb: float | None = None
    waver: float | None = None


@dataclass(frozen=True, slots=True)
class Meaning:
    """What the person means, for scoring only: which object, and where it has to be at the end."""

    object: str
    relation: str
    target: str | None = None
    area: Point2 | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """A table with objects, a sentence, and what the person points at while saying it (an id, a place, or nothing)."""

    objects: tuple[SceneObject, ...]
    say: str
    point_object: str | Point2 | None = None
    point_target: str | Point2 | None = None
    table: Table = field(default_factory=Table)
    person: PersonOptions = field(default_factory=PersonOptions)
    meaning: Meaning | None = None
    name: str = "scene"
    description: str = ""

    def object(self, object_id: str) -> SceneObject:
        """Return the object of an id.

        Raises:
            KeyError: there is none.
        """
        for obj in self.objects:
            if obj.id == object_id:
                return obj
        raise KeyError(object_id)


@dataclass(frozen=True, slots=True)
class ObjectState:
    """Truth about one object: pose (4, 4) of its body frame and the size of its bounding box (3,) in that frame [m].

    The body frame lies in the middle of the object (of its round part where it has a handle), z up as it stands.
    """

    id: str
    kind: str
    colour: str
    pose: FloatArray
    size: FloatArray

    @property
    def position(self) -> FloatArray:
        """Origin (3,) of the body frame [m]."""
        return np.asarray(self.pose[:3, 3])


@dataclass(frozen=True, slots=True)
class Light:
    """What getCameraImage needs to light the room; direction (3,) points from the table to the lamp."""

    direction: tuple[float, float, float]
    colour: tuple[float, float, float]
    distance: float = 3.0
    ambient: float = 0.6
    diffuse: float = 0.45
    specular: float = 0.05


@dataclass(frozen=True, slots=True)
class SpokenWord:
    """One word of the person with its own times since the start of the performance [s]."""

    text: str
    start_s: float
    end_s: float
