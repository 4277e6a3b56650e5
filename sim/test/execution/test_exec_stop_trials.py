# SPDX-License-Identifier: Apache-2.0
"""Stopped at any moment of any stage, the robot stands still at once and the next command is carried out."""

import pytest
from uncom_sim.bench_execution.command_generation import WorkArea
from uncom_sim.bench_execution.stop_trials import STAGES, StopResult, run_stops, summary_of_stops
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.types import Scene, SceneObject
from uncom_tiago_exec.types import Stage


def check(total, count):
    assert total["stops"] == total["still"] == total["usable"] == count, total
    assert total["table_contacts"] == 0
    assert total["base_drift_m"] < 0.02


def test_a_stop_counts_as_good_only_if_nothing_moves_and_a_command_succeeds_after_it():
    good = StopResult(Stage.LIFTING, False, 0.01, 0.001, ((True, "done"),))
    later = StopResult(Stage.HOMING, True, 0.01, 0.001, ((False, "refused"), (True, "done")))
    never = StopResult(Stage.HOMING, False, 0.2, 0.001, ((False, "refused"),) * 3)
    total = summary_of_stops([good, later, never])
    assert (total["stops"], total["still"], total["next_succeeded"], total["usable"]) == (3, 2, 1, 2)
    assert len(total["failures"]) == 4


@pytest.mark.timeout(300)
def test_a_stop_while_something_is_taken_and_carried_leaves_it_still_and_usable():
    total = run_stops(3, 1)
    check(total, 3)


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("seed", range(5))
def test_a_stop_at_any_of_fifty_moments_of_all_stages_leaves_it_still_and_usable(seed):
    total = run_stops(10, seed)
    check(total, 10)
    assert total["next_succeeded"] >= 8, total["failures"]  # single commands fail sometimes
    assert len(set(total["stages"]) & {stage.name for stage in STAGES}) >= 4


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_stop_while_base_or_arm_are_on_their_way_to_what_is_far_leaves_it_still_and_usable():
    """What is asked for is too far for the arms, so the base drives nearer and back."""
    things = (
        SceneObject("o0", "can", natural_colour("can"), 0.82, 0.2, 0.0),
        SceneObject("o1", "box", natural_colour("box"), 0.6, -0.3, 0.0),
    )
    total = run_stops(8, 1, scene=Scene(things, "do it"), area=WorkArea((0.78, 0.84), 0.25))
    check(total, 8)
    assert total["driving"] > 0
