# SPDX-License-Identifier: Apache-2.0
"""`uncom demo`: a simulated person and TIAGo++, the whole graph, to the physical result."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import (
    SubParsers,
    add_json,
    add_output,
    add_parameters,
    natural_number,
    output_folder,
    positive_float,
    simulator_needed,
)
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.options import INPUT
from uncom_bringup.report import progress


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "demo",
        help="simulated person and TIAGo++: from sound and images to the physical result",
        description="A simulated person speaks and points; the graph understands and moves a simulated TIAGo++.",
    )
    parser.add_argument("--scenario", metavar="NAME", help="i to vi, or a name (default: iv)")
    parser.add_argument("--scene", metavar="FILE", help="your own scene (JSON) instead of a scenario")
    parser.add_argument("--say", metavar="TEXT", help="another sentence than the scene's")
    parser.add_argument("--seed", type=natural_number, default=0, help="places, voice, hand, light (default: 0)")
    add_output(parser, "report, video, bag")
    parser.add_argument("--timeout", type=positive_float, default=240.0, metavar="S", help="give up after (wall time)")
    parser.add_argument("--no-video", action="store_true", help="leave out video.mp4")
    parser.add_argument("--no-bag", action="store_true", help="leave out run.mcap")
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run one demo."""
    if options.scenario and options.scene:
        raise BadInputError("give --scenario or --scene, not both")
    if options.say is not None and len(options.say) > INPUT.max_spoken_chars:
        raise BadInputError(f"--say is too long; at most {INPUT.max_spoken_chars} characters are spoken")
    with simulator_needed():
        from uncom_sim.demo import demo  # noqa: PLC0415  (only when it runs)
        from uncom_sim.demo import options as demo_options  # noqa: PLC0415

    scene = Path(options.scene) if options.scene else None
    scenario = options.scenario or demo_options.DEFAULT_SCENARIO
    prepared = demo_options.prepare_scene(scenario, scene, options.say, options.seed)
    folder = output_folder(options.out, f"{scene.stem if scene else scenario}-{options.seed}", options.force)
    say = output.note if options.json else output.emit
    result = demo.run_demo(
        demo_options.DemoOptions(
            scene=prepared,
            folder=folder,
            seed=options.seed,
            timeout_s=options.timeout,
            record=not options.no_bag,
            video=not options.no_video,
            parameter_files=tuple(Path(name) for name in options.params_file),
        ),
        say,
    )
    if options.json:
        output.emit_json(result.to_json())
    else:
        say(progress.head("report", result.artifacts["report"]))
        say(result.in_words())
    return result.exit_status
