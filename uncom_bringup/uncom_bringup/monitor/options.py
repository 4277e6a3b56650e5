# SPDX-License-Identifier: Apache-2.0
"""Numbers of keeping pictures of a run."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class FrameOptions:
    """JPEG quality of the pictures that a record keeps."""

    annotated_quality: int = tunable(95, unit="%", meaning="of the annotated pictures, which the report shows")
    video_quality: int = tunable(85, unit="%", meaning="of camera and overview, which the video shows")


FRAME = FrameOptions()
