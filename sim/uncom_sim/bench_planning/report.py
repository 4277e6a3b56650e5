# SPDX-License-Identifier: Apache-2.0
"""The figures of the planning benchmark as text."""

from __future__ import annotations

from typing import Any


def table(result: dict[str, Any]) -> str:
    """Return the figures as lines for people."""
    ik, plan, full, whole = (result[key] for key in ("ik", "plan", "plan_full", "whole"))
    return "\n".join(
        [
            f"inverse kinematics: {ik['success']:.1%}, median {ik['median_ms']:.2f} ms, 95 % {ik['p95_ms']:.2f} ms",
            f"one state check: {result['check_us']:.1f} us",
            f"plan, shortcuts: {plan['success']:.1%}, median {plan['median_ms']:.1f} ms, 95 % {plan['p95_ms']:.1f} ms",
            f"plan, simplified: {full['success']:.1%}, median {full['median_ms']:.1f} ms, 95 % {full['p95_ms']:.1f} ms",
            f"states in collision when looked at again: {plan['recheck_colliding'] + full['recheck_colliding']}",
            f"whole pick-and-place: {whole['success']:.1%}, median {whole['median_s']:.2f} s",
            f"its motion: {whole['motion_median_s']:.1f} s, {whole['motion_over_bound']} of the lower bound",
            *(
                f"  {name}: {spent['mean_s']:.1f} s, {spent['over_bound']} of the bound"
                for name, spent in whole["motion_by_stage"].items()
            ),
            *(
                f"of {name}'s time: {times['ik']} for poses, {times['check']} for checks, {times['plan']} for plans"
                for name, times in result["ratios"].items()
            ),
            *(f"{name}: {why}" for name, why in result["peers"].items() if isinstance(why, str)),
            *(
                f"{name} had no time for {left['poses']} of the poses and {left['plans']} of the plans"
                for name, peer in result["peers"].items()
                if isinstance(peer, dict) and any((left := peer.get("left_out", {})).values())
            ),
        ]
    )
