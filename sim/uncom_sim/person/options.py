# SPDX-License-Identifier: Apache-2.0
"""Numbers of the simulated person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.transforms import FloatArray
from uncom_common.tunables import tunable

from uncom_sim.objects.palette import Rgb


@dataclass(frozen=True, slots=True)
class HandModelOptions:
    """Size and resolution of the skin of hand and forearm; an adult's hand of 19 cm."""

    forearm_m: float = tunable(0.25, unit="m", meaning="length of the forearm")
    sleeve_end_m: float = tunable(0.66, unit="m", meaning="how far behind the wrist the sleeve ends")
    grid_step_m: float = tunable(0.0045, unit="m", meaning="step of the grid on which the skin is found")
    blend_m: float = tunable(0.0030, unit="m", meaning="width over which the parts of the hand are blended")
    thumb_radii_m: tuple[float, ...] = tunable(
        (0.016, 0.0145, 0.0118, 0.0102, 0.0082),
        unit="m",
        meaning="radii of wrist and thumb at their joints, base to tip",
    )
    thumb_joints_m: tuple[tuple[float, float, float], ...] = tunable(
        (
            (0.0, 0.0, 0.0),
            (0.024, 0.028, -0.012),
            (0.056, 0.045, -0.022),
            (0.084, 0.040, -0.031),
            (0.104, 0.028, -0.035),
        ),
        unit="m",
        meaning="joints of wrist and thumb in the hand frame, base to tip",
    )


@dataclass(frozen=True, slots=True)
class HandPlacementOptions:
    """Poses of the hand that are tried for a pointing gesture."""

    turns_deg: tuple[int, ...] = tunable(
        (0, -15, 15, -30, 30, -45, 45, -60, 60),
        unit="deg",
        meaning="turns of the finger about the vertical away from the direction of the arm",
    )
    pitches_deg: tuple[int, ...] = tunable(
        (26, 34, 42, 50), unit="deg", meaning="pitches of the finger below the horizontal"
    )
    distances_m: tuple[float, ...] = tunable(
        (0.10, 0.14, 0.19, 0.24), unit="m", meaning="distances of the fingertip from what is pointed at"
    )
    same_place_m: float = tunable(0.03, unit="m", meaning="objects this near to what is pointed at are not in its way")
    supination_deg: float = tunable(
        30.0, unit="deg", meaning="turn of the hand by which people point with the thumb somewhat up"
    )

    @property
    def turns_rad(self) -> FloatArray:
        """Return turns_deg in radians (N,)."""
        return np.radians(self.turns_deg)

    @property
    def pitches_rad(self) -> FloatArray:
        """Return pitches_deg in radians (N,)."""
        return np.radians(self.pitches_deg)

    @property
    def supination_rad(self) -> float:
        """Return supination_deg in radians."""
        return float(np.radians(self.supination_deg))


@dataclass(frozen=True, slots=True)
class BehaviourOptions:
    """When the person enters, points and leaves."""

    withdrawal_m: float = tunable(0.80, unit="m", meaning="how far a hand is drawn back, out of the robot's sight")
    unseen_s: float = tunable(
        0.5, unit="s", meaning="how long nobody is seen at first, so that the robot sees the table without the hand"
    )
    enter_s: float = tunable(0.9, unit="s", meaning="how long the hand takes to come")
    leave_s: float = tunable(0.9, unit="s", meaning="how long the hand takes to go")
    dwell_s: float = tunable(0.25, unit="s", meaning="how long the hand stays after the last pointing")
    shortest_pointing_s: float = tunable(0.35, unit="s", meaning="shortest time of one pointing")
    after_s: float = tunable(1.2, unit="s", meaning="how long sound and pictures go on after the end")
    longest_pause_s: float = tunable(0.45, unit="s", meaning="longest pause made between the words for two gestures")
    tremor_m: float = tunable(0.0012, unit="m", meaning="amplitude of the tremor of a hand that is held still")
    easy_reach_m: float = tunable(0.55, unit="m", meaning="how far over the table one reaches with ease")


@dataclass(frozen=True, slots=True)
class AcousticsOptions:
    """Levels of the recorded sound; 1 is full scale."""

    peak: float = tunable(0.5, meaning="greatest amplitude of the speech")
    speech_level: float = tunable(0.02, meaning="amplitude from which on a sample belongs to speech")
    noise_floor: float = tunable(3e-5, meaning="noise of an empty room before a microphone, about 70 dB below speech")
    reverberation_time_s: float = tunable(0.35, unit="s", meaning="time in which the echo falls by 60 dB")


@dataclass(frozen=True, slots=True)
class VoiceOptions:
    """How the ends of words are found in the voice's samples."""

    silence: float = tunable(0.01, meaning="amplitude up to which a sample is silence; 1 is full scale")


@dataclass(frozen=True, slots=True)
class AppearanceOptions:
    """What the person wears."""

    sleeve_colours: tuple[Rgb, ...] = tunable(
        (
            (0.20, 0.27, 0.42),
            (0.32, 0.33, 0.35),
            (0.45, 0.22, 0.25),
            (0.20, 0.34, 0.30),
            (0.62, 0.62, 0.60),
        ),
        meaning="colours (red, green, blue from 0 to 1) of sleeves that are drawn",
    )


HAND_MODEL = HandModelOptions()
HAND_PLACEMENT = HandPlacementOptions()
BEHAVIOUR = BehaviourOptions()
ACOUSTICS = AcousticsOptions()
VOICE = VoiceOptions()
APPEARANCE = AppearanceOptions()
