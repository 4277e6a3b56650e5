# SPDX-License-Identifier: Apache-2.0
"""One skill a primitive, and a new one is a class and its registration."""

import json
from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import lemon_and_bowl, make_task, robot, start_positions
from uncom_common.primitive import Primitive
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.planning.plan import MoveStep, Plan
from uncom_tiago_exec.scene.scene_model import build_scene
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.motion_steps import move
from uncom_tiago_exec.skills.registry import SKILLS, SkillRegistry
from uncom_tiago_exec.skills.skill import ObjectEnd, Skill
from uncom_tiago_exec.types import Stage


class Nod(Skill):
    """Lifts the torso by two centimetres."""

    primitives = (Primitive.POINT,)
    object_end = ObjectEnd.UNTOUCHED

    def plan(self, request):
        arm = request.arms["left"]
        start = arm.group.clamp(arm.start)
        up = start + np.array([0.02, *np.zeros(7)])
        step = move(arm, Stage.APPROACHING, (np.vstack([start, up]), arm.free_motion_checker(0.0), 1.0), "up")
        return Plan(arm.side, (step,), request.scene)


def task_of(primitive):
    return make_task(lemon_and_bowl(np.random.default_rng(1)), primitive)


def test_every_primitive_but_none_has_a_skill():
    assert {primitive for primitive in Primitive if primitive in SKILLS} == set(Primitive) - {Primitive.NONE}


@pytest.mark.parametrize("primitive", [p for p in Primitive if p in SKILLS])
def test_a_skill_is_found_by_the_primitives_that_it_names(primitive):
    assert primitive in SKILLS[primitive].primitives


def test_a_skill_of_ones_own_plans_once_it_is_registered():
    planner = ManipulationPlanner(robot(), ExecutionConfig(), SkillRegistry((Nod(),)))
    plan = planner.plan(task_of("point"), start_positions())
    (step,) = plan.steps
    assert isinstance(step, MoveStep)
    torso = step.trajectory.positions[:, 0]
    assert torso[-1] - torso[0] == pytest.approx(0.02)


def test_what_has_no_skill_is_refused_in_words():
    planner = ManipulationPlanner(robot(), ExecutionConfig(), SkillRegistry((Nod(),)))
    with pytest.raises(RefusedError, match="I have not learned to put in yet"):
        planner.plan(task_of("put_in"), start_positions())


def test_a_command_without_an_action_is_refused_in_words():
    with pytest.raises(RefusedError, match="I was not told what to do"):
        SKILLS[Primitive.NONE]


def test_two_skills_cannot_claim_one_primitive():
    with pytest.raises(ValueError, match="POINT has two skills"):
        SkillRegistry((Nod(), SKILLS[Primitive.POINT]))


def test_what_is_poured_from_is_looked_for_where_it_was_and_not_in_the_target():
    things = lemon_and_bowl(np.random.default_rng(1))
    task = make_task(things, "pour", target="bowl")
    scene = build_scene(task)
    assert scene.target is not None
    goal = SKILLS[Primitive.POUR].destination(task, scene)
    assert np.allclose(goal.xy, scene.moved.middle[:2])
    seen_task, seen_plan = SKILLS[Primitive.POUR].expected(task, Plan("left", (), scene))
    assert seen_task == replace(task, target=None)
    assert seen_plan.scene.target is None


def test_only_what_is_put_on_something_must_be_seen_on_it():
    needed = {p for p in Primitive if p in SKILLS and SKILLS[p].rests_on_target(task_of(p))}
    assert needed == {Primitive.PUT_ON, Primitive.STACK}


def test_what_is_held_can_only_be_set_down_and_what_stays_in_reach_goes_by_the_middle():
    placing = {Primitive.PLACE, Primitive.PUT_IN, Primitive.PUT_ON, Primitive.STACK}
    assert {p for p in Primitive if p in SKILLS and SKILLS[p].sets_down_held} == placing
    relayed = {p: SKILLS[p].relay_primitive for p in Primitive if p in SKILLS and SKILLS[p].relay_primitive}
    assert relayed == {**dict.fromkeys(placing, Primitive.PLACE), Primitive.PUSH: Primitive.PUSH}


def test_a_skill_says_what_it_has_done():
    task = task_of("pick")
    assert SKILLS[Primitive.PICK].done_text(task, "lemon") == "I hold the lemon"
    assert SKILLS[Primitive.GIVE].done_text(task, "lemon") == "here is the lemon"
    assert SKILLS[Primitive.POINT].done_text(task, "") == "that is the lemon"
    assert SKILLS[Primitive.PLACE].done_text(task, "") == "I have put the lemon down"


def test_a_plan_tells_what_was_tried_for_it():
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(task_of("pick"), start_positions())
    stages = {stage["stage"]: stage for stage in plan.as_data()["stages"]}
    grasps = stages["grasps, quick look"]
    assert grasps["tried"] == len(grasps["succeeded"]) + sum(grasps["failures"].values())
    assert any(name.startswith(plan.side) for name in grasps["succeeded"])
    assert stages["scene"]["succeeded"]
    assert all(stage["cost_s"] >= 0.0 for stage in stages.values())
    json.dumps(plan.as_data())
