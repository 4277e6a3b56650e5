# SPDX-License-Identifier: Apache-2.0
"""Numbers of the annotated picture: sizes in pixels, colours as RGB."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable

Colour = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class AnnotationOptions:
    """How a decision is drawn."""

    chosen_colour: tuple[int, int, int] = tunable((255, 140, 0), meaning="of what was chosen (orange, as in the paper)")
    ray_colour: tuple[int, int, int] = tunable((40, 220, 60), meaning="of the pointing ray (green, as in the paper)")
    candidate_colour: tuple[int, int, int] = tunable((225, 225, 225), meaning="colour of what was not chosen")
    caption_background: int = tunable(24, meaning="grey of the caption and of the gap")
    caption_height_px: int = tunable(36, unit="px", meaning="height of the caption")
    caption_scale: float = tunable(0.65, meaning="largest size of the caption's letters")
    caption_margin_px: int = tunable(16, unit="px", meaning="room left beside the caption's text, both sides together")
    label_scale: float = tunable(0.4, meaning="size of the letters of labels")
    gap_px: int = tunable(4, unit="px", meaning="gap between the two frames")
    min_probability: float = tunable(0.02, meaning="a candidate less likely than this is not boxed")
    ray_fingers: float = tunable(8.0, meaning="finger lengths that the ray is drawn if it meets nothing chosen")
    tint: float = tunable(0.35, meaning="share of the colour over what was chosen")
    limit_px: float = tunable(4096.0, unit="px", meaning="points farther outside the picture are drawn at this")


ANNOTATION = AnnotationOptions()
