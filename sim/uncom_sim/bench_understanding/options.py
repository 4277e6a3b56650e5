# SPDX-License-Identifier: Apache-2.0
"""Numbers of the benchmark's runs."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class StressOptions:
    """The curves of difficulty."""

    takes: int = tunable(22, meaning="takes of a curve where nothing else is asked for")


STRESS = StressOptions()
