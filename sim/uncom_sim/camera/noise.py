# SPDX-License-Identifier: Apache-2.0
"""The errors of a structured-light camera: grain, depth noise that grows with distance, missing depth at edges."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_sim.camera.options import SENSOR, SensorOptions

Rgb = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class CameraNoise:
    """Standard deviations; depth noise grows with the square of distance, as it does when depth comes from parallax."""

    rgb: float = 1.8  # [grey levels]
    depth_at_1m: float = 0.0015  # [m]
    edge_step: float = 0.02  # depth jumps above this share of the distance lose their pixels
    edge_loss: float = 0.75  # share of the pixels lost there
    speckle_loss: float = 0.0005  # share of pixels lost anywhere

    def scaled(self, level: float) -> CameraNoise:
        """Return noise of another strength; 0 is a perfect camera, 1 this one."""
        return CameraNoise(
            self.rgb * level,
            self.depth_at_1m * level,
            self.edge_step,
            min(1.0, self.edge_loss * level),
            min(1.0, self.speckle_loss * level),
        )


class NoisyCamera:
    """Adds noise that depends on nothing but the seed and the physics step, so that pictures repeat.

    Noise is cut at random places from sheets drawn once, which costs a tenth of drawing it anew.
    """

    def __init__(
        self, noise: CameraNoise, seed: int, height: int, width: int, *, options: SensorOptions = SENSOR
    ) -> None:
        """Draw the sheets of noise for pictures of height and width [px]; the same seed gives the same noise."""
        self._options = options
        self.noise = noise
        self._seed = seed
        rng = np.random.default_rng([seed, height, width])
        sheet = (height + options.spare_noise_px, width + options.spare_noise_px)
        grain = rng.standard_normal((*sheet, 3), dtype=np.float32) * np.array([0.5, 0.4, 0.6], np.float32)
        grain += rng.standard_normal((*sheet, 1), dtype=np.float32) * np.float32(0.85)
        self._grain = np.round(grain * np.float32(noise.rgb)).astype(np.int16)
        self._depth_grain = rng.standard_normal(sheet, dtype=np.float32) * np.float32(noise.depth_at_1m)
        self._luck = rng.random(sheet, dtype=np.float32)

    def expose(self, rgb: Rgb, step: int) -> Rgb:
        """Return a picture (H, W, 3) with grain."""
        if self.noise.rgb <= 0.0:
            return rgb
        grain = np.ascontiguousarray(self._grain[self._cut(rgb.shape, step, 1)])
        return np.asarray(cv2.add(rgb, grain, dtype=cv2.CV_8U), dtype=np.uint8)

    def measure(self, depth: Depth, step: int) -> Depth:
        """Return a depth image (H, W) [m] as the sensor gives it: NaN where it sees nothing."""
        near, far = self._options.depth_range_m
        noise = self.noise
        known = np.isfinite(depth)
        finite = np.where(known, depth, np.float32(2.0 * far))
        measured = finite + self._depth_grain[self._cut(depth.shape, step, 2)] * finite * finite
        missing = ~known | (measured < near) | (measured > far)
        if noise.edge_loss > 0.0:
            kernel = np.ones((3, 3), np.uint8)
            jump = cv2.dilate(finite, kernel) - cv2.erode(finite, kernel)
            luck = self._luck[self._cut(depth.shape, step, 3)]
            edge = jump > np.maximum(np.float32(noise.edge_step) * finite, np.float32(0.01))
            missing |= (edge & (luck < noise.edge_loss)) | (luck > 1.0 - noise.speckle_loss)
        measured[missing] = np.nan
        return np.asarray(measured)

    def _cut(self, shape: tuple[int, ...], step: int, sheet: int) -> tuple[slice, slice]:
        """Return where on a sheet the noise of a step lies."""
        row, column = np.random.default_rng([self._seed, step, sheet]).integers(0, self._options.spare_noise_px, 2)
        return slice(row, row + shape[0]), slice(column, column + shape[1])
