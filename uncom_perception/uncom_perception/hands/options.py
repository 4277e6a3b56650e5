# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune hands."""

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
class HandFinderOptions:
    """How often, and how closely, images are searched for hands."""

    agreement: float = tunable(
        0.25, meaning="of the hand's size: how far the landmarks of two looks at one hand may differ"
    )
    clear_evidence: float = tunable(0.6, meaning="evidence for pointing above which no other look is needed")
    max_looks: int = tunable(6, meaning="closer looks at one image, at most")
    large_hand: float = tunable(0.4, meaning="of the image: size of a hand that leaves little room for closer looks")
    fresh_images: int = tunable(3, meaning="images in a row without a hand up to which all looks are taken")
    settled_s: float = tunable(0.8, unit="s", meaning="a scene that stays as it is for so long is known")
    idle_period_s: float = tunable(
        0.45, unit="s", meaning="period at which a scene is looked at in which nothing changes"
    )
    closer_period_s: float = tunable(
        0.35, unit="s", meaning="period at which a hand that does not point is looked at closely"
    )
    least_size_px: float = tunable(12.0, unit="px", meaning="smaller hands are not believed")


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
class MotionOptions:
    """When something moves in the image."""

    width_px: int = tunable(160, unit="px", meaning="width to which images are scaled")
    change: float = tunable(
        16.0,
        unit="Lab",
        meaning="difference of colour that is a change, lightness at half weight: shadows hardly count",
    )
    least_share: float = tunable(0.004, meaning="least share of the image that has changed")
    greatest_share: float = tunable(0.35, meaning="greatest share: beyond it the light has changed")
    learning_rate: float = tunable(0.2, meaning="share of a new image in the remembered background")


@dataclass(frozen=True, slots=True)
class ImageNoiseOptions:
    """How noisy images are smoothed before hands are looked for."""

    clean: float = tunable(4.0, meaning="noise in grey levels that a picture with fine texture has, too")
    blur_px_per_level: float = tunable(
        0.09,
        unit="px",
        meaning="standard deviation of the blur for each grey level of noise: about a quarter of the noise is left",
    )
    row_step: int = tunable(8, unit="px", meaning="every so manieth row is looked at")
    piece_px: int = tunable(32, unit="px", meaning="length of the pieces of a row in which noise is measured")
    calm_share: float = tunable(0.25, meaning="share of the places that have no texture, in most pictures")


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
HAND_FINDER = HandFinderOptions()
FINGER_DEPTH = FingerDepthOptions()
HAND_SIZE = HandSizeOptions()
MOTION = MotionOptions()
IMAGE_NOISE = ImageNoiseOptions()
POINTING_RAY = PointingRayOptions()
