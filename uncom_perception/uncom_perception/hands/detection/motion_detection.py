# SPDX-License-Identifier: Apache-2.0
"""Where something came into the picture: that is where to look again for a hand."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.hands.detection.options import MOTION, MotionOptions
from uncom_perception.image_arrays import FloatArray, RgbImage


@dataclass(frozen=True, slots=True)
class Newcomer:
    """A changed region: its tip (2,) [px], the part furthest in from the image's border, and its length [px]."""

    tip: FloatArray
    center: FloatArray
    length: float


class MotionWatch:
    """Keeps a picture of the scene without hands and says what has changed since."""

    def __init__(self, *, options: MotionOptions = MOTION) -> None:
        """Know nothing yet."""
        self._options = options
        self._background: npt.NDArray[np.float32] | None = None
        self.quiet = False  # whether the last picture was that of the scene as it is known

    def changed(self, image_rgb: RgbImage) -> Newcomer | None:
        """Return the largest object that was not there before, or None; a moved camera starts anew."""
        small = _reduced(image_rgb, options=self._options)
        self.quiet = False
        if self._background is None or self._background.shape != small.shape:
            self._background = small
            return None
        difference = (small - self._background) * np.array([0.5, 1.0, 1.0], np.float32)
        change = np.einsum("ijk,ijk->ij", difference, difference) > self._options.change**2
        mask = cv2.morphologyEx(change.view(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        share = cv2.countNonZero(mask) / mask.size
        if share > self._options.greatest_share:
            self._background = small
            return None
        if share < self._options.least_share:
            self._background += self._options.learning_rate * (small - self._background)
            self.quiet = True
            return None
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
        label = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()) if count > 1 else 0
        if label == 0 or stats[label, cv2.CC_STAT_AREA] < self._options.least_share * mask.size:
            return None
        return _newcomer(labels == label, image_rgb.shape[1] / small.shape[1])


def _reduced(image_rgb: RgbImage, *, options: MotionOptions = MOTION) -> npt.NDArray[np.float32]:
    height = max(1, round(image_rgb.shape[0] * options.width_px / image_rgb.shape[1]))
    small = cv2.resize(image_rgb, (options.width_px, height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small.astype(np.float32) / 255.0, cv2.COLOR_RGB2LAB), dtype=np.float32)


def _newcomer(region: npt.NDArray[np.bool_], scale: float) -> Newcomer:
    height, width = region.shape
    v, u = np.nonzero(region)
    border = np.minimum.reduce([u, v, width - 1 - u, height - 1 - v])
    entered = border <= 1
    if entered.any():
        entry = np.array([u[entered].mean(), v[entered].mean()])
        distance = np.hypot(u - entry[0], v - entry[1])
    else:
        distance = border.astype(float)
    far = distance >= np.percentile(distance, 92)
    tip = np.array([u[far].mean(), v[far].mean()])
    length = max(np.ptp(u), np.ptp(v)) + 1.0
    return Newcomer(tip * scale, np.array([u.mean(), v.mean()]) * scale, float(length) * scale)
