# SPDX-License-Identifier: Apache-2.0
"""What every object detector offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from uncom_common.camera import PinholeCamera

from uncom_perception.exceptions import InvalidImageError
from uncom_perception.image_types import DepthImage, FloatArray, RgbImage
from uncom_perception.types import HandsFrame, Scene


class ObjectDetector(ABC):
    """Finds things in an image and says how well each phrase fits each of them."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Back end and weights, as told in every result."""

    @abstractmethod
    def detect(
        self,
        image_rgb: RgbImage,
        depth: DepthImage | None,
        camera: PinholeCamera | None,
        camera_in_base: FloatArray | None,
        phrases: Sequence[str],
        hands: HandsFrame | None = None,
        stamp_s: float = 0.0,
    ) -> Scene:
        """Return what is seen; the caller knows the frame's name, frame_id stays empty.

        Args:
            image_rgb: (H, W, 3) uint8.
            depth: registered to the image, (H, W) [m], NaN where unknown; or None.
            camera: intrinsics; geometry needs it.
            camera_in_base: (4, 4) pose of the camera's optical frame in the base frame; geometry is answered in the
                base frame if it is given, else in the optical frame.
            phrases: noun phrases, one query each; "objects" fits everything, "table" the table.
            hands: hands seen in the same image; they and their forearms are no objects.
            stamp_s: time of the image [s].

        Raises:
            InvalidImageError: shapes that do not fit together.
        """


def check_images(image_rgb: RgbImage, depth: DepthImage | None, camera: PinholeCamera | None) -> None:
    """Reject images that do not fit together.

    Raises:
        InvalidImageError: they do not.
    """
    if image_rgb.ndim != 3 or image_rgb.shape[2] != 3 or image_rgb.dtype != np.uint8 or image_rgb.size == 0:
        raise InvalidImageError(f"need an RGB image (H, W, 3) uint8, got {image_rgb.shape} {image_rgb.dtype}")
    if depth is not None and depth.shape != image_rgb.shape[:2]:
        size, got = image_rgb.shape[1::-1], depth.shape[1::-1]
        raise InvalidImageError(f"depth must be registered to the image: {got} px is not {size} px")
    if camera is not None and depth is not None and (camera.height, camera.width) != depth.shape:
        raise InvalidImageError(
            f"the camera is for {camera.width}x{camera.height} px, the image is {depth.shape[1::-1]}"
        )
