# SPDX-License-Identifier: Apache-2.0
"""Attributes of the person at the table; what the options leave open is drawn from the seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_sim.objects.palette import Rgb
from uncom_sim.person.options import APPEARANCE, AppearanceOptions
from uncom_sim.person.voice import VOICES
from uncom_sim.types import HANDS, PersonOptions


@dataclass(frozen=True, slots=True)
class PersonAttributes:
    """A person with nothing left open but the side to stand on; meaning and units as in PersonOptions."""

    side: str | None
    hand: str
    skin: float
    size: float
    voice: str
    speed: float
    pitch: float
    lead: float
    lag: float
    noise: float
    reverb: float
    waver: float
    sleeve: Rgb


def draw_attributes(
    options: PersonOptions, rng: np.random.Generator, *, appearance_options: AppearanceOptions = APPEARANCE
) -> PersonAttributes:
    """Draw what the options leave open."""
    drawn = PersonAttributes(
        side=None,
        hand=str(rng.choice(HANDS)),
        skin=float(rng.uniform(0.0, 0.8)),
        size=float(rng.uniform(0.93, 1.07)),
        voice=str(rng.choice(VOICES)),
        speed=float(rng.uniform(135.0, 160.0)),
        pitch=float(rng.uniform(35.0, 65.0)),
        lead=float(rng.uniform(0.10, 0.30)),
        lag=float(rng.uniform(0.10, 0.25)),
        noise=float(rng.uniform(0.0, 0.01)),
        reverb=0.0,
        waver=0.0,
        sleeve=appearance_options.sleeve_colours[int(rng.integers(len(appearance_options.sleeve_colours)))],
    )
    fixed = {name: getattr(options, name) for name in PersonOptions.__dataclass_fields__}
    values = {name: getattr(drawn, name) for name in PersonAttributes.__dataclass_fields__}
    return PersonAttributes(**values | {name: value for name, value in fixed.items() if value is not None})
