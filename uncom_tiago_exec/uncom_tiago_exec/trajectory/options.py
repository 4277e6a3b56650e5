# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune trajectory."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class TimingOptions:
    """How a path is timed."""

    step_s: float = tunable(0.002, unit="s", meaning="step of the time grid on which limits are held")


TIMING = TimingOptions()
