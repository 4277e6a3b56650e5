# SPDX-License-Identifier: Apache-2.0
"""`uncom bench understanding`: 159 takes of 22 scenarios, understood by the cores of the nodes, scored by the truth."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import (
    SubParsers,
    add_json,
    add_output,
    add_parameters,
    add_workers,
    natural_number,
    output_folder,
    positive_number,
    simulator_needed,
)

_SCENARIOS = range(1, 23)  # of the paper


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the benchmark."""
    parser = subparsers.add_parser(
        "understanding",
        help="how often object, action and target are what the person meant (the paper's 22 scenarios, 159 takes)",
        description="Make takes of a simulated person who speaks and points, understand them, score by the truth.",
    )
    parser.add_argument("--seed", type=natural_number, default=0, help="everything random comes from it (default: 0)")
    parser.add_argument(
        "--takes", type=positive_number, metavar="N", help="only so many takes, spread over the scenarios"
    )
    parser.add_argument("--scenarios", type=_numbers, default=(), metavar="LIST", help="only these, e.g. 1,4,7-9")
    add_workers(parser)
    add_output(parser, "the results")
    parser.add_argument("--cache", metavar="DIR", help="where takes are kept, about 8 MB each (default: user's cache)")
    parser.add_argument("--bags", metavar="DIR", help="also write every take as a bag (.mcap) there, about 4 MB each")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has left")
    parser.add_argument("--no-variants", action="store_true", help="only ours: no published rules, no ablations")
    parser.add_argument(
        "--stress", action="store_true", help="curves instead: blur, light, distractors, landmarks, word times, words"
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the benchmark."""
    with simulator_needed():
        from uncom_sim.bench_understanding import run as benchmark  # noqa: PLC0415  (only when it runs)
        from uncom_sim.bench_understanding.run_stress import run_stress_curves  # noqa: PLC0415
    folder = output_folder(options.out, f"bench-understanding-{options.seed}", options.force)
    measure = run_stress_curves if options.stress else benchmark.run_benchmark
    result = measure(
        benchmark.BenchmarkOptions(
            seed=options.seed,
            scenarios=options.scenarios,
            takes=options.takes,
            jobs=options.jobs,
            scheduler=options.scheduler,
            folder=folder,
            cache=Path(options.cache) if options.cache else default_cache(),
            fresh=options.fresh,
            variants=not options.no_variants,
            bags=Path(options.bags) if options.bags else None,
            parameter_files=tuple(Path(name) for name in options.params_file),
        )
    )
    if options.json:
        output.emit_json(result.report)
    else:
        output.emit(result.text)
    return 0


def default_cache() -> Path:
    """Return the folder where takes are kept: UNCOM_CACHE, or `uncom` in the user's cache folder."""
    if os.environ.get("UNCOM_CACHE"):
        return Path(os.environ["UNCOM_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "uncom"


def _numbers(text: str) -> tuple[int, ...]:
    """Read "1,4,7-9" (an argparse type)."""
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        try:
            low, high = int(first), int(last or first)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{part!r} is neither a number nor a range such as 7-9") from None
        if low > high or low not in _SCENARIOS or high not in _SCENARIOS:
            raise argparse.ArgumentTypeError(f"{part!r}: scenarios are 1 to 22")
        found |= set(range(low, high + 1))
    return tuple(sorted(found))
