# SPDX-License-Identifier: Apache-2.0
"""mplib in the planning benchmark: it gets the same robot, its answers are judged here, its failures are sentences."""

import os
import re
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pinocchio as pin
import pytest
from uncom_sim.bench_planning import run as bench_planning
from uncom_sim.bench_planning.options import MPLIB, PROBLEMS, MplibOptions
from uncom_sim.bench_planning.peer_mplib import PYTHON, judged, run_mplib, srdf, write_arms
from uncom_sim.bench_planning.problems import locked_urdf
from uncom_sim.exceptions import WorkerError
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.robot_model import RobotModel


@pytest.fixture(scope="module")
def robot():
    return RobotModel(tiago_urdf())


@pytest.fixture(scope="module")
def start():
    return home_positions(0.35, (0.2, -0.95), 0.02)


@pytest.fixture(scope="module")
def problem(robot, start):
    return next(bench_planning.single_problems(robot, start, 1, 5))


@pytest.fixture(scope="module")
def poses(robot, start):
    return bench_planning.ik_problems(robot, start, 4, 5)


@pytest.fixture(scope="module")
def reaches(robot, start):
    groups = {side: robot.group(side, start) for side in ("left", "right")}
    return lambda pose, q: bench_planning._reaches(groups[pose.side], q, pose.target, PROBLEMS.inset_m)


def answered(poses, problem, **changes):
    """Return what a worker says that gives each pose the configuration to begin at, and the straight way."""
    whole = {
        "version": "0.2.1",
        "ik": {"ms": [2.0, 1.0], "q": [poses[0].near.tolist(), None]},
        "check": {"us": 200.123, "colliding": 3},
        "plan": {"ms": [400.0], "paths": [[problem.start.tolist(), problem.goal.tolist()]]},
    }
    return {**whole, **changes}


def run(poses, problem, start, options=MPLIB):
    return run_mplib(poses, lambda *_: False, [problem], (problem, []), start, mplib_options=options)


def pretend_python(tmp_path, monkeypatch, script):
    path = tmp_path / "python"
    path.write_text(f"#!{sys.executable}\nimport sys\n{script}\n")
    path.chmod(0o755)
    monkeypatch.setenv(PYTHON, str(path))


def test_the_srdf_allows_exactly_the_contacts_that_our_own_checks_do_not_look_at(robot, start):
    group = robot.group("left", start)
    looked_at = {frozenset((group.links[i], group.links[j])) for i, j in group.body_pairs}
    text = srdf(locked_urdf(tiago_urdf(), group_joints("left"), start))
    allowed = {frozenset((e.get("link1"), e.get("link2"))) for e in ET.fromstring(text).iter("disable_collisions")}
    links = sorted(set(group.links))
    pairs = {frozenset((a, b)) for i, a in enumerate(links) for b in links[i + 1 :]}
    assert not allowed & looked_at
    assert allowed | looked_at == pairs


def test_descriptions_lie_beside_the_meshes_that_they_name(tmp_path, start):
    arms = write_arms(tmp_path, start)
    assert set(arms) == {"left", "right"}
    for about in arms.values():
        text = (tmp_path / about["urdf"]).read_text()
        meshes = [mesh.get("filename") for mesh in ET.fromstring(text).iter("mesh")]
        assert "package://" not in text
        assert meshes
        assert all((tmp_path / mesh).is_file() for mesh in meshes)
        assert list(pin.buildModelFromXML(text).names)[1:] == about["joints"]


def test_a_missing_environment_is_named_with_the_command_that_makes_it(monkeypatch):
    monkeypatch.delenv(PYTHON, raising=False)
    assert "./uncom setup --peers" in run_mplib([], lambda *_: False, [], (None, []), {})


def test_a_python_that_is_not_there_is_named(tmp_path, monkeypatch, poses, problem, start):
    monkeypatch.setenv(PYTHON, str(tmp_path / "nowhere"))
    assert "cannot be started" in run(poses, problem, start)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("sys.exit('import of mplib failed\\nModuleNotFoundError: no mplib\\nand so on')", "status 1.*no mplib"),
        ("sys.exit(7)", "status 7: it said nothing"),
        ("pass", "no answer that can be read"),
        ("open(sys.argv[-1], 'w').write('{')", "no answer that can be read"),
        ("open(sys.argv[-1], 'w').write('[]')", "no answer that can be read"),
        ("open(sys.argv[-1], 'w').write('{}')", "cannot be used: KeyError: 'ik'"),
    ],
)
def test_a_failing_worker_is_a_sentence(tmp_path, monkeypatch, poses, problem, start, script, said):
    pretend_python(tmp_path, monkeypatch, script)
    sentence = run(poses, problem, start)
    assert re.fullmatch(f"not compared: .*{said}", sentence), sentence


def test_a_worker_that_hangs_is_ended(tmp_path, monkeypatch, poses, problem, start):
    pretend_python(tmp_path, monkeypatch, "import time; time.sleep(100)")
    assert "had not answered after 1 s" in run(poses, problem, start, MplibOptions(budget_s=0.5, patience_s=0.5))


def test_poses_count_where_our_own_kinematics_agrees(robot, start, poses, problem, reaches):
    groups = [robot.group(p.side, start) for p in poses[:2]]
    known = [p._replace(target=group.forward(p.near)) for p, group in zip(poses[:2], groups, strict=True)]
    done = {"ms": [2.0, 1.0], "q": [known[0].near.tolist(), (known[1].near + 0.1).tolist()]}
    found = judged(answered(poses, problem, ik=done), [*known, *poses[2:]], reaches, [problem])
    assert found["ik"] == {"poses": 2, "success": 0.5, "median_ms": 1.5}
    assert found["check_us"] == 200.12
    assert found["check_colliding"] == 3


def test_ways_are_looked_at_again_by_our_checker(poses, problem, reaches):
    found = judged(answered(poses, problem), poses, reaches, [problem])["plan"]
    assert found["success"] == 1.0
    assert found["recheck_inside_margins"] > 0  # the straight way is never free
    assert found["problems"] == 1
    none = judged(answered(poses, problem, plan={"ms": [9.0], "paths": [None]}), poses, reaches, [problem])["plan"]
    assert none["success"] == 0.0
    assert none["recheck_inside_margins"] == 0


def test_what_was_not_begun_in_time_is_left_out_rather_than_failed(poses, problem, reaches):
    found = judged(answered(poses, problem), poses, reaches, [problem, problem, problem])
    assert found["left_out"] == {"poses": 2, "plans": 2}
    assert found["plan"]["problems"] == 1
    assert found["plan"]["success"] == 1.0


@pytest.mark.parametrize(
    "changes",
    [
        {"ik": {"ms": [], "q": []}},
        {"ik": {"ms": [1.0], "q": []}},
        {"ik": {"ms": [1.0], "q": [[0.0] * 7]}},
        {"plan": {"ms": [1.0], "paths": [[[0.0, 1.0], [2.0]]]}},
        {"plan": {"ms": ["soon"], "paths": [None]}},
        {"check": None},
    ],
)
def test_an_answer_that_cannot_be_used_is_refused(poses, problem, reaches, changes):
    with pytest.raises(WorkerError, match=r"cannot be used|nothing was done"):
        judged(answered(poses, problem, **changes), poses, reaches, [problem])


@pytest.mark.skipif(
    not Path(os.environ.get(PYTHON, "/nowhere")).exists(), reason="./uncom setup --peers was not asked for"
)
def test_mplib_solves_poses_and_plans_of_ours(robot, start, poses, reaches):
    problems = list(bench_planning.single_problems(robot, start, 2, 5))
    around, states = bench_planning.check_states(robot, start, 5)
    found = run_mplib(poses, reaches, problems, (around, states[:50]), start)
    assert not isinstance(found, str), found
    assert found["ik"]["success"] == 1.0
    assert found["plan"]["success"] == 1.0
    assert found["check_colliding"] == 0
