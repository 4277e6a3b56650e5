# SPDX-License-Identifier: Apache-2.0
"""What a structured-light camera adds to a perfect picture: grain, depth that worsens with distance, missing edges."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_sim.camera.views import DEPTH_RANGE_M

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
    """Adds noise that depends on nothing but the seed and the physics step, so that pictures repeat."""

    def __init__(self, noise: CameraNoise, seed: int) -> None:
        """Seed the noise."""
        self.noise = noise
        self._seed = seed

    def expose(self, rgb: Rgb, step: int) -> Rgb:
        """Return a picture (H, W, 3) with grain."""
        if self.noise.rgb <= 0.0:
            return rgb
        rng = np.random.default_rng([self._seed, step, 1])
        grain = rng.standard_normal(rgb.shape[:2], dtype=np.float32) * np.float32(self.noise.rgb)
        # One draw for brightness and a rolled one for colour: half the cost of three, and no pattern is left.
        tint = np.roll(grain, (97, 31), axis=(0, 1)) * np.float32(0.5)
        noisy = rgb.astype(np.float32)
        noisy[..., 0] += grain + tint
        noisy[..., 1] += grain
        noisy[..., 2] += grain - tint
        return np.asarray(np.clip(noisy + 0.5, 0.0, 255.0).astype(np.uint8))

    def measure(self, depth: Depth, step: int) -> Depth:
        """Return a depth image (H, W) [m] as the sensor gives it: NaN where it sees nothing."""
        rng = np.random.default_rng([self._seed, step, 2])
        near, far = DEPTH_RANGE_M
        measured = depth.astype(np.float32, copy=True)
        noise = self.noise
        if noise.depth_at_1m > 0.0:
            grain = rng.standard_normal(depth.shape, dtype=np.float32)
            measured += grain * np.float32(noise.depth_at_1m) * depth * depth
        missing = ~np.isfinite(depth) | (measured < near) | (measured > far)
        if noise.edge_loss > 0.0:
            finite = np.where(np.isfinite(depth), depth, np.float32(far))
            kernel = np.ones((3, 3), np.uint8)
            jump = cv2.dilate(finite, kernel) - cv2.erode(finite, kernel)
            edge = jump > np.maximum(noise.edge_step * finite, 0.01)
            luck = rng.random(depth.shape, dtype=np.float32)
            missing |= (edge & (luck < noise.edge_loss)) | (luck > 1.0 - noise.speckle_loss)
        measured[missing] = np.nan
        return measured
