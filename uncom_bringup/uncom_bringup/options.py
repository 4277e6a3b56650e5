# SPDX-License-Identifier: Apache-2.0
"""Numbers of the command line and of the check of a machine."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class InputOptions:
    """Bounds of what is given on the command line."""

    max_sentence_chars: int = tunable(10_000, meaning="longest sentence that is parsed; nobody says more in one")
    max_spoken_chars: int = tunable(2000, meaning="longest text that the simulated person speaks")


@dataclass(frozen=True, slots=True)
class MachineOptions:
    """What a machine should have."""

    image_segment_mib: int = tunable(
        512, unit="MiB", meaning="shared memory that ./uncom wants before it gives every node room for images"
    )
    min_cores: int = tunable(2, meaning="with less the demo is slow")
    min_memory_gib: float = tunable(4.0, unit="GiB", meaning="main memory")


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """Bounds of `uncom test`."""

    timeout_s: int = tunable(1500, unit="s", meaning="longest time of one check")


INPUT = InputOptions()
MACHINE = MachineOptions()
CHECK = CheckOptions()
