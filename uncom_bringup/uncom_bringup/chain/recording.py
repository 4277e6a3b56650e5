# SPDX-License-Identifier: Apache-2.0
"""What the chained cores are given: sound, images, camera and transforms of one recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import StampedTransform
from uncom_perception.objects.scene_detector import OutsidePoses

Rgb = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """One colour image (H, W, 3) with its stamp [s] and registered depth (H, W) [m], NaN where unknown, or None."""

    stamp_s: float
    rgb: Rgb
    depth: Depth | None


class Recording(Protocol):
    """What the robot's senses gave: sound, images, the camera, and where it was."""

    @property
    def samples(self) -> npt.NDArray[np.int16]:
        """Mono sound (N,)."""

    @property
    def sample_rate(self) -> int:
        """Samples a second [Hz]."""

    @property
    def sound_start_s(self) -> float:
        """Stamp of the first sample [s]."""

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics of the images."""

    @property
    def camera_frame(self) -> str:
        """Frame of the images."""

    @property
    def transforms(self) -> Sequence[tuple[StampedTransform, bool]]:
        """All transforms; True for static ones."""

    @property
    def object_poses(self) -> Sequence[OutsidePoses]:
        """Poses of an outside estimator; empty where there is none."""

    def frames(self) -> Iterator[CameraFrame]:
        """Yield the images in order of time."""
