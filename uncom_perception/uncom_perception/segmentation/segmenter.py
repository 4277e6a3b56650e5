# SPDX-License-Identifier: Apache-2.0
"""What every segmentation back end offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from uncom_perception.types import Box, Mask

FloatArray = npt.NDArray[np.float64]
RgbImage = npt.NDArray[np.uint8]
DepthImage = npt.NDArray[np.float32]


class Segmenter(ABC):
    """Gives the mask of the object at a point or in a box."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Back end and weights, as told in every result."""

    @abstractmethod
    def segment(
        self, image_rgb: RgbImage, depth: DepthImage | None, points: FloatArray, boxes: Sequence[Box]
    ) -> tuple[list[Mask], list[float]]:
        """Return one mask (H, W) and one score (0 to 1) for each point (N, 2) [px], then for each box.

        Raises:
            InvalidImageError: images that do not fit together, or a point or box outside the image.
        """
