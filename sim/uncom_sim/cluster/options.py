# SPDX-License-Identifier: Apache-2.0
"""Numbers of the worker processes."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ClusterLimits:
    """When a worker or a scheduler is given up."""

    deaths_per_task: int = tunable(2, meaning="worker processes that may die at one task before the run ends")
    connect_s: float = tunable(15.0, unit="s", meaning="how long a scheduler has to answer, and to have a worker")
    memory_share: float = tunable(
        0.95, meaning="share of its part of the machine's memory at which a local worker is ended"
    )


CLUSTER_LIMITS = ClusterLimits()
