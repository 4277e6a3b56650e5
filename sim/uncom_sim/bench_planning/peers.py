# SPDX-License-Identifier: Apache-2.0
"""The same planning problems given to other libraries, where they are installed.

roboplan runs in this process; mplib wants another numpy (1.26) than everything else here and runs in a process of
its own. Peers keep no margins and look at the meshes as they are; their paths are looked at again by our checker.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from uncom_sim.bench_planning.peer_mplib import run_mplib
from uncom_sim.bench_planning.peer_roboplan import run_roboplan
from uncom_sim.bench_planning.problems import Checks, IkProblem, Problem, Reaches


def run_peers(
    poses: Sequence[IkProblem],
    reaches: Reaches,
    problems: Sequence[Problem],
    states: Checks,
    positions: dict[str, float],
) -> dict[str, Any]:
    """Return what each peer does with the same problems, or why it is not there."""
    return {
        "roboplan": run_roboplan(poses, reaches, problems, states, positions),
        "mplib": run_mplib(poses, reaches, problems, states, positions),
    }


def ratios(own: dict[str, Any], peers: dict[str, Any]) -> dict[str, Any]:
    """Return our medians as multiples of each peer's."""
    found = {}
    for name, peer in peers.items():
        if isinstance(peer, dict):
            found[name] = {
                "ik": round(own["ik"]["median_ms"] / peer["ik"]["median_ms"], 3),
                "check": round(own["check_us"] / peer["check_us"], 3),
                "plan": round(own["plan"]["median_ms"] / peer["plan"]["median_ms"], 3),
            }
    return found
