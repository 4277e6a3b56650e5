# SPDX-License-Identifier: Apache-2.0
"""One robot carries out command after command: what is told of memory, drift and trouble is what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from uncom_sim.bench_execution import consecutive_commands
from uncom_sim.bench_execution.command_generation import next_command, random_scene
from uncom_sim.bench_execution.consecutive_commands import (
    CommandResult,
    resident_mb,
    run_consecutive_commands,
    summarise_commands,
    table,
)
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import model
from uncom_sim.objects.footprint import outline
from uncom_sim.types import ObjectState
from uncom_sim.world.scene_variation import all_visible


def world_states(scene, height=0.75):
    states = []
    for thing in scene.objects:
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(thing.yaw), -np.sin(thing.yaw)], [np.sin(thing.yaw), np.cos(thing.yaw)]]
        pose[:3, 3] = thing.x, thing.y, height
        states.append(ObjectState(thing.id, thing.kind, thing.colour, pose, model(thing.kind, thing.colour).size))
    return states


def test_memory_is_counted_from_after_the_warm_up_and_trouble_as_the_longest_run_of_failures():
    results = [
        CommandResult(
            "x", number not in (3, 4, 20), 0.001 * number, 0.0, 100.0 + number, 0.03 * (number == 7), number == 3
        )
        for number in range(30)
    ]
    total = summarise_commands(results)
    assert (total["commands"], total["succeeded"], total["in_trouble"]) == (30, 27, 2)
    assert (total["refused"], total["bystanders_moved"], len(total["failures"])) == (1, 1, 3)
    assert total["rss_growth_mb"] == pytest.approx(10.0)
    assert total["home_error_max"] == total["home_error_last"] == 0.029
    text = table({**total, "table_contacts": 0, "ended": "no room"})
    assert "27 of 30" in text
    assert "no room" in text


def test_what_was_measured_is_told_even_if_there_is_no_further_command(monkeypatch):
    """The second command cannot be drawn; the first is in the result, with the reason."""
    drawn = []

    def once(*args):
        drawn.append(args)
        if len(drawn) > 1:
            raise SceneError("no room is left")
        return next_command(*args)

    monkeypatch.setattr(consecutive_commands, "next_command", once)
    total = run_consecutive_commands(5, 3)
    assert total["commands"] == 1
    assert "no room is left" in total["ended"]
    drawn.append(())
    with pytest.raises(SceneError, match="no room is left"):
        run_consecutive_commands(5, 3)


def test_commands_are_drawn_for_what_stands_there_and_for_what_is_held():
    rng = np.random.default_rng(5)
    scene = random_scene(("can", "box", "cup", "bottle", "apple"), rng)
    states = world_states(scene)
    cases = [next_command(number, states, scene, rng) for number in range(40)]
    assert {case.primitive for case in cases} == {"pick", "place"}
    assert {case.meaning.relation for case in cases} >= {"area", "none", "behind", "right_of"}
    for case in cases:
        if case.place is not None:
            thing = scene.object(case.meaning.object)
            moved = replace(thing, x=case.place[0], y=case.place[1])
            rest = [other for other in scene.objects if other.id != thing.id]
            assert all(outline(moved).distance(outline(other)) > 0.035 for other in rest)
            assert all_visible(replace(scene, objects=(*rest, moved)))
    held = [next_command(number, states, scene, rng, "o2") for number in range(10)]
    assert all((case.meaning.object, case.primitive) == ("o2", "place") for case in held)


def test_a_thing_that_is_half_out_of_the_picture_leaves_places_for_the_others():
    rng = np.random.default_rng(6)
    scene = random_scene(("can", "box"), rng)
    scene = replace(scene, objects=(scene.objects[0], replace(scene.objects[1], x=0.56, y=0.44)))
    assert not all_visible(scene)
    assert next_command(0, world_states(scene), scene, rng, "o0").place is not None


def test_where_nothing_is_left_on_the_table_no_command_is_drawn():
    rng = np.random.default_rng(5)
    scene = random_scene(("can",), rng)
    fallen = world_states(scene, height=0.1)
    with pytest.raises(SceneError, match="within reach"):
        next_command(0, fallen, scene, rng)


def test_resident_memory_grows_with_what_is_kept():
    before = resident_mb()
    kept = bytearray(60_000_000)
    kept[::4096] = b"x" * len(kept[::4096])
    assert 40.0 < resident_mb() - before < 90.0


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_hundred_commands_in_a_row_leak_nothing_and_end_at_the_start_pose():
    total = run_consecutive_commands(100, 7)
    assert total["succeeded"] >= 95, total["failures"]
    assert total["in_trouble"] <= 2
    assert total["home_error_max"] < 0.02
    assert total["base_drift_m"] < 0.02
    assert total["rss_growth_mb"] < 30.0
    assert total["table_contacts"] == 0
