# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune hands that are found: following them, their size, and the rays that are made of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class HandBridgeOptions:
    """When a pointing hand is followed over images in which it is not found."""

    moved: float = tunable(
        1.0, meaning="of the hand's size: a hand that has moved farther in between is no longer followed"
    )
    turned_rad: float = tunable(
        0.6, unit="rad", meaning="a hand that has turned further in between is no longer followed"
    )
    growth_rad_s: float = tunable(0.6, unit="rad/s", meaning="how fast a direction that is not seen becomes uncertain")


@dataclass(frozen=True, slots=True)
class FingerDepthOptions:
    """How the direction of a finger is measured in the depth image."""

    steps: int = tunable(14, meaning="samples along the finger")
    seen_share: float = tunable(
        0.75, meaning="share of the finger, from its tip on, that is looked at: behind it are the knuckles"
    )
    half_window: float = tunable(0.4, meaning="of the finger's length: how far to either side is looked")
    thickness_m: float = tunable(
        0.015, unit="m", meaning="what is deeper or nearer than the finger by this much is something else"
    )
    least_width_m: float = tunable(0.006, unit="m", meaning="least width of a finger")
    greatest_width_m: float = tunable(0.028, unit="m", meaning="greatest width of a finger")
    least_span: float = tunable(0.3, meaning="share of the finger that must be seen")
    line_spread: float = tunable(0.06, meaning="of the finger's length: how far its middle may lie off a line")
    least_correction_rad: float = tunable(
        math.radians(6.0), unit="rad", meaning="smaller corrections of the direction are not made"
    )
    greatest_correction_rad: float = tunable(math.radians(40.0), unit="rad", meaning="larger ones are not believed")
    least_length_px: float = tunable(
        12.0, unit="px", meaning="a finger that is shorter in the image is too short to be measured"
    )
    least_samples: int = tunable(6, meaning="samples along the finger that must be seen")
    least_known: int = tunable(3, meaning="known depth pixels that a sample needs")
    longest_gap: int = tunable(2, unit="px", meaning="gap between pixels of one finger, at most")


@dataclass(frozen=True, slots=True)
class HandSizeOptions:
    """Metric size of a hand, from the wrist to the base of the middle finger."""

    least_palm_m: float = tunable(0.03, unit="m", meaning="what is far smaller is no hand")
    greatest_palm_m: float = tunable(0.16, unit="m", meaning="what is far larger is no hand")
    memory_s: float = tunable(0.5, unit="s", meaning="how long the place of a hand is remembered to tell its motion")


@dataclass(frozen=True, slots=True)
class PointingRayOptions:
    """How a ray is made of a hand (paper, section III-E)."""

    finger_radius_m: float = tunable(
        0.008, unit="m", meaning="radius of a finger: its axis lies this far behind the surface that depth sees"
    )
    least_line_m: float = tunable(0.035, unit="m", meaning="from index base to tip, of children")
    greatest_line_m: float = tunable(0.16, unit="m", meaning="from index base to tip, of large men")
    landmark_noise: float = tunable(0.025, meaning="of the hand's size in the image: standard error of a landmark")
    systematic_rad: float = tunable(
        math.radians(2.5), unit="rad", meaning="part of the error of a direction that does not come from landmark noise"
    )
    least_length_px: float = tunable(2.0, unit="px", meaning="a finger that is shorter in the image has no direction")
    least_samples: int = tunable(6, meaning="depth samples along a finger that a ray in space needs")
    least_hand_samples: int = tunable(5, meaning="depth samples on a hand that its distance needs")
    least_apart: float = tunable(0.2, meaning="of the finger's length: how far apart two samples are that draw a line")
    least_line_span: float = tunable(
        0.4, meaning="of the finger's length: span of the samples that agree with the line"
    )


HAND_BRIDGE = HandBridgeOptions()
FINGER_DEPTH = FingerDepthOptions()
HAND_SIZE = HandSizeOptions()
POINTING_RAY = PointingRayOptions()
