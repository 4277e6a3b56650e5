# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune how hands are found in an image."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


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


HAND_FINDER = HandFinderOptions()
MOTION = MotionOptions()
IMAGE_NOISE = ImageNoiseOptions()
