# SPDX-License-Identifier: Apache-2.0
"""Numbers of the simulated robot's driver."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class AudioOptions:
    """How sound is sent."""

    chunk_s: float = tunable(0.05, unit="s", meaning="length of one message of sound")


AUDIO = AudioOptions()
