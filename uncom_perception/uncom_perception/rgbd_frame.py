# SPDX-License-Identifier: Apache-2.0
"""A colour image with the depth, the camera and the pose that place what is seen in it."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.camera import PinholeCamera

from uncom_perception.exceptions import InvalidImageError
from uncom_perception.image_arrays import DepthImage, FloatArray, RgbImage, check_rgb


@dataclass(frozen=True, slots=True)
class RgbdFrame:
    """One image of a camera, as a detector takes it.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: registered to the image, (H, W) [m], NaN where unknown; or None.
        camera: intrinsics, or None; geometry needs them.
        camera_in_base: (4, 4) pose of the camera's optical frame in the base frame, or None.
        camera_frame: name of the camera's optical frame.
        base_frame: name of the base frame.
        stamp_s: time of the image [s].

    Raises:
        InvalidImageError: images, or image and camera, of different sizes.
    """

    rgb: RgbImage
    depth: DepthImage | None = None
    camera: PinholeCamera | None = None
    camera_in_base: FloatArray | None = None
    camera_frame: str = ""
    base_frame: str = ""
    stamp_s: float = 0.0

    def __post_init__(self) -> None:
        """Reject images that do not fit together."""
        check_rgb(self.rgb)
        depth, camera = self.depth, self.camera
        if depth is None:
            return
        if depth.shape != self.rgb.shape[:2]:
            size, got = self.rgb.shape[1::-1], depth.shape[1::-1]
            raise InvalidImageError(f"depth must be registered to the image: {got} px is not {size} px")
        if camera is not None and (camera.height, camera.width) != depth.shape:
            raise InvalidImageError(
                f"the camera is for {camera.width}x{camera.height} px, the image is {depth.shape[1::-1]}"
            )

    @property
    def frame_id(self) -> str:
        """Name of the frame that geometry is answered in: the base frame if the camera's pose is known."""
        return self.camera_frame if self.camera_in_base is None else self.base_frame
