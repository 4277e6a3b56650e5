# SPDX-License-Identifier: Apache-2.0
"""Numbers of storing camera images, repairing bags and turning a video into one."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ImageOptions:
    """How colour images are compressed."""

    jpeg_quality: int = tunable(
        80,
        unit="%",
        meaning="quality of JPEG where none is asked for",
        source="default of image_transport's compressed plugin",
    )
    png_compression: int = tunable(6, meaning="effort of PNG, 0 to 9")


@dataclass(frozen=True, slots=True)
class DepthOptions:
    """How depth images are compressed: as inverse depth in steps, with the noise evened out."""

    step_per_m: float = tunable(0.002, unit="1/m", meaning="one step of inverse depth: 2 mm at 1 m, 8 mm at 2 m")
    hold_steps: float = tunable(
        1.0, meaning="a neighbour along the row that differs by no more steps gets the same value"
    )
    noise_per_m: float = tunable(
        0.006,
        unit="1/m",
        meaning="differences evened out: four standard deviations of a structured-light camera's noise",
    )
    filter_window_px: int = tunable(5, unit="px", meaning="window of the bilateral filter")
    filter_reach_px: float = tunable(1.7, unit="px", meaning="standard deviation of its weight over distance")
    png_compression: int = tunable(4, meaning="effort of PNG, 0 to 9")


@dataclass(frozen=True, slots=True)
class BagFileOptions:
    """How damaged bags are saved and told of."""

    max_growth: int = tunable(1000, meaning="a cut-off database is padded to at most this multiple of its size")
    max_error_chars: int = tunable(200, meaning="longer texts of a reader's error are cut off")


@dataclass(frozen=True, slots=True)
class VideoBagOptions:
    """How a video file becomes a bag."""

    start_s: float = tunable(
        10.0, unit="s", meaning="stamp of the video's beginning; zero would mean that there is no stamp"
    )
    chunk_s: float = tunable(0.05, unit="s", meaning="length of one message of sound")
    max_picture_hz: float = tunable(
        10.0, unit="Hz", meaning="pictures a second that are kept: hands do not move faster"
    )
    max_side_px: int = tunable(960, unit="px", meaning="longer side of a picture; larger ones are scaled down")
    view_angle_deg: float = tunable(
        63.0, unit="deg", meaning="horizontal angle of view, assumed between a webcam's and a telephone's"
    )
    jpeg_quality: int = tunable(92, unit="%", meaning="quality of the pictures in the bag")


IMAGE = ImageOptions()
DEPTH = DepthOptions()
BAG_FILE = BagFileOptions()
VIDEO_BAG = VideoBagOptions()
