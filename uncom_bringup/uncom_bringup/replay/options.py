# SPDX-License-Identifier: Apache-2.0
"""Numbers of the pace of a replay."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class PlaybackOptions:
    """How messages are sent at their time."""

    prefetched: int = tunable(40, meaning="messages that are made ready before their time")
    tick_s: float = tunable(0.01, unit="s", meaning="longest sleep between two checks of keys and clock")
    clock_period_s: float = tunable(
        0.02, unit="s", meaning="least wall time between two messages on /clock; every listener wakes at each"
    )
    wake_up_delay_s: float = tunable(
        0.0004, unit="s", meaning="how late a sleep ends; so much before its time a message is waited for awake"
    )
    rate_factor: float = tunable(1.25, meaning="factor on the rate for one key press")


@dataclass(frozen=True, slots=True)
class PlayerOptions:
    """How the player publishes."""

    clock_period_ns: int = tunable(
        10_000_000, unit="ns", meaning="least time of the bag between two messages on /clock"
    )


PLAYBACK = PlaybackOptions()
PLAYER = PlayerOptions()
