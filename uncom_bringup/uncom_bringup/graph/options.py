# SPDX-License-Identifier: Apache-2.0
"""Numbers of starting nodes as processes and of choosing a ROS domain."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ProcessOptions:
    """How node processes are ended and told of."""

    stop_timeout_s: float = tunable(4.0, unit="s", meaning="time from SIGINT until nodes that still run are killed")
    min_wait_s: float = tunable(0.05, unit="s", meaning="least wait for each node, once that time is over")
    log_tail_lines: int = tunable(6, meaning="last lines of a node's log in the error when it ends")


@dataclass(frozen=True, slots=True)
class DomainOptions:
    """How a free ROS domain id is looked for."""

    probed_participants: int = tunable(
        6, meaning="participants of a domain whose ports must be free for the domain to be"
    )


PROCESS = ProcessOptions()
DOMAIN = DomainOptions()
