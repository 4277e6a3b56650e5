# SPDX-License-Identifier: Apache-2.0
"""What every pointing style offers; adding a style is adding a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from uncom_perception.hands.detection.detector import RawHand
from uncom_perception.hands.detection.landmarks import FINGERS, Landmark
from uncom_perception.hands.styles.options import POINTING_STYLE, PointingStyleOptions
from uncom_perception.image_arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Pose:
    """Shape of a hand: how much each finger is extended, 0 (curled) to 1 (straight out)."""

    thumb: float
    index: float
    middle: float
    ring: float
    little: float
    spread_rad: float  # angle between index and middle finger

    @property
    def curl_of_others(self) -> float:
        """How much middle, ring and little finger are curled, 0 to 1; one may be misjudged."""
        middle, ring, little = sorted(1.0 - e for e in (self.middle, self.ring, self.little))
        return 0.25 * middle + 0.375 * ring + 0.375 * little


def hand_pose(hand: RawHand, *, options: PointingStyleOptions = POINTING_STYLE) -> Pose:
    """Judge the fingers by their joints in space and in the image, whichever shows a finger to be out.

    Landmarks in space do not suffer from foreshortening, but their depth is a guess that at times bends a finger which
    is plainly straight in the image; a curled finger looks straight and long in neither.
    """
    world, flat = hand.world, hand.landmarks[:, :2]
    palm = np.linalg.norm(flat[Landmark.WRIST] - flat[Landmark.MIDDLE_MCP]) / max(hand.size_px, 1e-9)
    trust = _logistic((float(palm) - 0.28) / 0.03)  # a palm seen end-on makes every finger look long
    extension = {n: max(_extension(world, j), trust * _extension(flat, j, 0.93)) for n, j in FINGERS.items()}
    spread = _angle(world[8] - world[6], world[12] - world[10])
    # Two fingers that are both plainly out in the image are as far apart as they are there.
    if trust * min(_extension(flat, FINGERS[n], 0.93) for n in ("index", "middle")) > options.plain_extension:
        spread = max(spread, _angle(flat[8] - flat[5], flat[12] - flat[9]))
    return Pose(**extension, spread_rad=spread)


def _extension(points: FloatArray, joints: tuple[int, int, int, int], least_straight: float = 0.82) -> float:
    a, b, c, d = (points[j] for j in joints)
    length = np.linalg.norm(b - a) + np.linalg.norm(c - b) + np.linalg.norm(d - c)
    straight = np.linalg.norm(d - a) / np.maximum(length, 1e-9)
    reach = np.linalg.norm(d - points[Landmark.WRIST]) / np.maximum(np.linalg.norm(b - points[Landmark.WRIST]), 1e-9)
    # A straight finger has reach 1.25 to 1.45 and straightness above 0.93, a curled one below 0.95 and 0.85.
    return float(_logistic((reach - 1.08) / 0.05) * _logistic((straight - least_straight) / 0.03))


def _logistic(x: float | np.floating[Any]) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -30.0, 30.0))))


def _angle(a: FloatArray, b: FloatArray) -> float:
    cosine = a @ b / np.maximum(np.linalg.norm(a) * np.linalg.norm(b), 1e-12)
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


class PointingStyle(ABC):
    """One way of pointing: how well a hand shows it, and along which landmarks it points."""

    name: str
    #: landmarks from the base of the pointing line to its tip
    line: tuple[int, ...]

    @abstractmethod
    def evidence(self, pose: Pose) -> float:
        """Return how sure it is that a hand of this shape points in this style, 0 to 1."""
