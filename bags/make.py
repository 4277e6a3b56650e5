# SPDX-License-Identifier: Apache-2.0
"""Makes the sample bags anew: `./uncom exec python bags/make.py [NAME ...]`.

Each is a take of the benchmark: everything in it comes from the seed. What was meant is known to this file alone; what
the graph is expected to make of a bag is written in manifest.yaml by hand, after it was looked at.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from uncom_sim.bench_understanding.ros.take_bag import write_bag
from uncom_sim.bench_understanding.takes.scenarios import scenario
from uncom_sim.bench_understanding.takes.take_planning import plan_take
from uncom_sim.bench_understanding.takes.take_synthesis import make_take
from uncom_sim.bench_understanding.takes.types import TakePlan

SEED = 5
# Name: scenario of the benchmark, number of the take.
TAKES = {
    "named_things": (14, 0),
    "this_here": (17, 0),
    "right_of_the_box": (16, 0),
    "which_of_the_bowls": (15, 0),
}


def plans() -> dict[str, TakePlan]:
    """Return the plan of each bag by its name."""
    found = {name: plan_take(scenario(number), index, SEED) for name, (number, index) in TAKES.items()}
    greeting = found["named_things"]
    scene = replace(greeting.scene, say="hello there", point_object=None, point_target=None)
    return {**found, "greeting": replace(greeting, scene=scene)}


def main(names: list[str]) -> None:
    """Write the bags with these names, or all."""
    folder = Path(__file__).parent
    for name, plan in plans().items():
        if names and name not in names:
            continue
        path = write_bag(make_take(plan), folder / f"{name}.mcap", force=True)
        sys.stderr.write(f'{path.name}: {path.stat().st_size / 1e6:.1f} MB, "{plan.scene.say}", {plan.scene.meaning}\n')


if __name__ == "__main__":
    main(sys.argv[1:])
