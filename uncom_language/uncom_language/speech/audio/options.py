# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune how sound is taken in."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ResamplerOptions:
    """Which sample rates are taken."""

    min_rate_hz: int = tunable(1000, unit="Hz", meaning="lowest sample rate that is accepted")
    max_rate_hz: int = tunable(400_000, unit="Hz", meaning="highest sample rate that is accepted")


@dataclass(frozen=True, slots=True)
class MicrophoneOptions:
    """How a microphone of this machine is read."""

    block_s: float = tunable(0.05, unit="s", meaning="length of the blocks that the driver hands over")
    max_age_s: float = tunable(
        1.0, unit="s", meaning="an older block has a wrong driver clock and is taken as just ended"
    )


RESAMPLER = ResamplerOptions()
MICROPHONE = MicrophoneOptions()
