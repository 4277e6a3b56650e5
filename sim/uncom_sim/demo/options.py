# SPDX-License-Identifier: Apache-2.0
"""What a demo is asked to do."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from uncom_common.tunables import tunable

from uncom_sim.types import Scene
from uncom_sim.world.intended_meaning import meaning_of
from uncom_sim.world.scene_file import load_scenario, load_scene

DEFAULT_SCENARIO = "iv"


@dataclass(frozen=True, slots=True)
class DemoTiming:
    """How long a demo waits for what."""

    start_timeout_s: float = tunable(90.0, unit="s", meaning="wall time in which the graph has to be up")
    poll_s: float = tunable(0.05, unit="s", meaning="wall time between two looks at the graph")
    settle_s: float = tunable(
        1.5, unit="s", meaning="simulated time after the last motion, so that what was let go comes to rest"
    )
    tail_s: float = tunable(0.3, unit="s", meaning="simulated time of sound that is examined after the person is done")


DEMO_TIMING = DemoTiming()


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """One run of a scene; where what it leaves behind goes.

    timeout_s is wall time from the person's start; record and video may be left out to save time.
    """

    scene: Scene
    folder: Path
    seed: int = 0
    timeout_s: float = 240.0
    record: bool = True
    video: bool = True
    parameter_files: tuple[Path, ...] = ()


def prepare_scene(scenario: str, scene_file: Path | None, say: str | None, seed: int) -> Scene:
    """Return the scene to play: a scenario arranged anew by the seed, or a file's scene as it is.

    Raises:
        SceneError: there is no such scenario, or the file cannot be used.
    """
    # In a file the places are the user's; there the seed draws only voice, hand and light.
    scene = load_scenario(scenario, say, seed) if scene_file is None else load_scene(scene_file, say)
    return replace(scene, meaning=meaning_of(scene))


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """Write a scene as a scene file has it."""
    table = scene.table
    made: dict[str, Any] = {
        "name": scene.name,
        "objects": [asdict(obj) for obj in scene.objects],
        "say": scene.say,
        "point_object": scene.point_object,
        "point_target": scene.point_target,
        "table": {"x": [table.x_min, table.x_max], "y": [table.y_min, table.y_max], "height": table.height},
        "person": {key: value for key, value in asdict(scene.person).items() if value is not None},
    }
    if scene.meaning is not None:
        made["meaning"] = {key: value for key, value in asdict(scene.meaning).items() if value is not None}
    return made
