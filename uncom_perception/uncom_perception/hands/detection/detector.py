# SPDX-License-Identifier: Apache-2.0
"""What every hand detector offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
RgbImage = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class RawHand:
    """A hand as a detector gives it.

    Landmarks (21, 3): x, y [px], z relative to the wrist [px] (comparable within one hand only).
    World landmarks (21, 3): about the hand's centre, camera axes [m].
    """

    handedness: str
    score: float
    landmarks: FloatArray
    world: FloatArray

    @property
    def size_px(self) -> float:
        """Larger side of the box around the landmarks [px]."""
        return float(np.ptp(self.landmarks[:, :2], axis=0).max())


class HandDetector(ABC):
    """Finds at most two hands in a colour image."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Back end and weights, as told in every result."""

    @abstractmethod
    def detect(self, image_rgb: RgbImage) -> tuple[RawHand, ...]:
        """Return the hands of an image (H, W, 3) uint8, best first.

        Raises:
            InvalidImageError: not an RGB image.
        """
