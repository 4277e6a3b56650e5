# SPDX-License-Identifier: Apache-2.0
"""Values of pointing: rays of hands, dwells of fused rays, and the gestures of phrases."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.transforms import FloatArray


@dataclass(frozen=True, slots=True)
class RayInSpace:
    """A pointing ray in the scene frame [m]: fingertip, unit direction, and the camera's centre, each (3,)."""

    tip: FloatArray
    direction: FloatArray
    eye: FloatArray


@dataclass(frozen=True, slots=True)
class RayObservation:
    """The ray of one hand in one image: in pixels always, in space if its depth is known.

    Attributes:
        stamp_s: of the image [s].
        hand: "left" or "right", as the detector says.
        score: of the hand (0 to 1), less where another hand points.
        sigma_rad: standard deviation of the direction [rad].
        width: of the image [px].
        tip_px, base_px: fingertip and base of the finger (2,).
        direction_px: unit direction in the image (2,).
        space: the ray in the scene's frame, if it is known.
    """

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
    """A stretch of time in which a hand pointed one way, its rays fused.

    Attributes:
        hand: as of its rays.
        stamps_s: of its frames [s].
        stillness: weight of each frame (0 to 1): less while the hand moves.
        sigma_rad: standard deviation of the fused direction [rad].
        width: of the images [px].
        finger_px: length of the finger in the image [px].
        tip_px: fingertip (2,); direction_px: unit direction in the image (2,).
        space: the fused ray in the scene's frame, if enough frames had depth.
    """

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
    """The gesture of one phrase.

    Attributes:
        role: part of the command: "object", "target", "reference2" or "anchor".
        start_s, end_s: time of the phrase's words [s].
        dwells: with their shares, which sum to 1.
        weight: of the frames behind them.
    """

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
