# SPDX-License-Identifier: Apache-2.0
"""The transitions of the execution tree: fallbacks, recovery, stop, and what the next command begins with."""

import json

import numpy as np
from exec_fixtures import (
    DrivingRobot,
    LookingOn,
    ObedientRobot,
    cylinder_cloud,
    lemon_and_bowl,
    make_task,
    robot,
)
from uncom_perception.types import Scene
from uncom_sim.bench_planning.scenes import detection, flat_table
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.types import Stage

CONFIG = ExecutionConfig(verify=False)


def scene_of(things):
    return Scene(0.0, "base_footprint", tuple(things), flat_table(), (), "test")


def branches(tree, *names):
    """Return the behaviours of a tree that have a name, in the order in which they ran."""
    found = [tree] if tree["name"] in names else []
    return found + [branch for child in tree.get("children", ()) for branch in branches(child, *names)]


def statuses(tree, *names):
    return [(branch["name"], branch["status"]) for branch in branches(tree, *names)]


def test_what_succeeds_at_once_tries_nothing_else():
    things = lemon_and_bowl(np.random.default_rng(0))
    told = []
    engine = Engine(robot(), ObedientRobot(scene_of(things), [0.05]), CONFIG, told.append)
    outcome = engine.execute(make_task(things, "put_in", target="bowl"))
    assert outcome.success, outcome.reason
    assert outcome.tree["status"] == "SUCCESS"
    assert statuses(outcome.tree, "from here") == [("from here", "SUCCESS")]
    assert not branches(outcome.tree, "by way of the middle")
    assert json.loads(json.dumps(outcome.tree)) == outcome.tree
    assert told[-1].stage is Stage.DONE
    assert told[-1].data["tree"] == outcome.tree


def test_what_is_out_of_reach_from_here_is_done_from_nearer_and_the_tree_says_why():
    can = detection("can", cylinder_cloud(0.93, 0.2, 0.033, 0.11, np.random.default_rng(5)))

    class Nearer(DrivingRobot):
        def look(self):
            seen = detection("can", np.asarray(can.geometry.cloud) - np.array([self.base.x, 0.0, 0.0]))
            return scene_of([seen])

    outcome = Engine(robot(), Nearer(scene_of([can]), [0.066]), CONFIG, lambda _: None).execute(
        make_task([can], "pick")
    )
    assert outcome.success, outcome.reason
    way = branches(outcome.tree, "one way or another")[0]
    assert [child["name"] for child in way["children"]] == ["from here", "from nearer"]
    assert [child["status"] for child in way["children"]] == ["FAILURE", "SUCCESS"]
    assert branches(way, "plan")[0]["reason"]
    assert [status for _, status in statuses(way, "drive nearer", "drive back")] == ["SUCCESS", "SUCCESS"]


class HeldUpOnce(LookingOn):
    """Its arm is held up on its first way to the object."""

    def follow(self, trajectory):
        super().follow(trajectory)
        if self.moves == 2:
            halfway = trajectory.positions[len(trajectory.times) // 2]
            self.joints |= dict(zip(trajectory.joint_names, halfway, strict=True))
            raise MotionError("arm_left_controller gave up: path tolerance")


def test_recovery_brings_the_arm_home_and_another_attempt_follows():
    things = lemon_and_bowl(np.random.default_rng(0))
    outcome = Engine(robot(), HeldUpOnce([scene_of(things)], [0.05]), CONFIG, lambda _: None).execute(
        make_task(things, "put_in", target="bowl")
    )
    assert outcome.success, outcome.reason
    assert statuses(outcome.tree, "attempt 1", "attempt 2") == [("attempt 1", "FAILURE"), ("attempt 2", "SUCCESS")]
    failed, recovery = branches(outcome.tree, "take and carry")[0], branches(outcome.tree, "go back without it")[0]
    assert "path tolerance" in failed["reason"]
    assert recovery["kind"] == "Recovery"


def test_a_stop_ends_the_command_where_it_is_and_the_next_one_begins_with_the_way_home():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = LookingOn([scene_of(things)], [0.05] * 3)
    machine.stop_at = 2
    engine = Engine(robot(), machine, CONFIG, lambda _: None)
    stopped = engine.execute(make_task(things, "put_in", target="bowl"))
    assert stopped.reason == "stopped on request"
    assert stopped.stage is not Stage.DONE
    assert branches(stopped.tree, "take and carry")[0]["reason"] == "stopped on request"
    assert machine.moves == 2, "nothing moves after a stop"
    assert branches(stopped.tree, "go back without it")[0]["reason"] == "not begun: stopped"
    machine.stop_at = None
    after = engine.execute(make_task(things, "put_in", target="bowl"))
    assert after.success, after.reason
    assert statuses(after.tree, "bring arm and base home") == [("bring arm and base home", "SUCCESS")]


def test_without_anything_left_over_no_way_home_is_gone():
    things = lemon_and_bowl(np.random.default_rng(0))
    engine = Engine(robot(), ObedientRobot(scene_of(things), [0.05]), CONFIG, lambda _: None)
    outcome = engine.execute(make_task(things, "pick"))
    assert not branches(outcome.tree, "bring arm and base home")
    put = engine.execute(make_task(things, "put_in", target="bowl"))
    assert put.success, put.reason
    assert statuses(put.tree, "with the object in the hand") == [("with the object in the hand", "SUCCESS")]
    assert not branches(put.tree, "with empty hands")


def test_a_command_that_is_not_known_fails_in_words_and_moves_nothing():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = ObedientRobot(scene_of(things), [0.05])
    outcome = Engine(robot(), machine, CONFIG, lambda _: None).execute(make_task(things, "none"))
    assert not outcome.success
    assert branches(outcome.tree, "know how")[0]["reason"] == outcome.reason
    assert machine.moves == 0
