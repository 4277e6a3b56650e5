# SPDX-License-Identifier: Apache-2.0
"""Waits of feeding bags to nodes, and of a replay."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class LockstepOptions:
    """Limits of wall time end a wait for a node that is broken, and are far above what a slow machine takes."""

    start_timeout_s: float = tunable(120.0, unit="s", meaning="until all nodes are up")
    answer_timeout_s: float = tunable(120.0, unit="s", meaning="until a node counts as broken that does not answer")
    quiet_timeout_s: float = tunable(
        20.0, unit="s", meaning="until the first messages are delivered and the vocabulary is known"
    )
    image_timeout_s: float = tunable(
        20.0, unit="s", meaning="until an image counts as lost; the middleware sends it again until then"
    )
    silence_chunk_s: float = tunable(
        0.05, unit="s", meaning="length of a message of silence after the bag, where its own sound does not tell"
    )
    max_silence_s: float = tunable(40.0, unit="s", meaning="longest silence after the bag's end, on its clock")
    depth_delay_ns: int = tunable(
        60_000_000, unit="ns", meaning="how much later than its picture a depth image may have been recorded"
    )
    max_pending: int = tunable(4, meaning="messages of one topic that may be on the way to a node")
    stamp_tolerance_s: float = tunable(1e-6, unit="s", meaning="stamps this near are the same")


@dataclass(frozen=True, slots=True)
class LatencyOptions:
    """Waits of the latency benchmark, in wall time."""

    start_timeout_s: float = tunable(90.0, unit="s", meaning="until all nodes are up")
    answer_timeout_s: float = tunable(
        40.0, unit="s", meaning="after the end of a bag: a late answer must not be taken for one to the next bag"
    )
    subscribers_timeout_s: float = tunable(10.0, unit="s", meaning="until the nodes have discovered the player")
    discovery_s: float = tunable(
        1.0, unit="s", meaning="further wait: discovery is mutual, and only one side of it can be seen"
    )


@dataclass(frozen=True, slots=True)
class ReplaySessionOptions:
    """Start and progress bar of a replay."""

    discovery_s: float = tunable(
        1.0, unit="s", meaning="wait before the first message, which subscribers not discovered yet would miss"
    )
    bar_chars: int = tunable(30, meaning="length of the progress bar")
    bar_period_s: float = tunable(0.1, unit="s", meaning="least wall time between two updates of the bar")


LOCKSTEP = LockstepOptions()
LATENCY = LatencyOptions()
REPLAY_SESSION = ReplaySessionOptions()
