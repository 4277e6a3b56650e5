# SPDX-License-Identifier: Apache-2.0
"""`uncom bench planning`: how fast and how surely motions are planned. Times are processor time of one thread.

Scenes hold 6 to 12 objects made as clouds of points, as a camera sees them; one of them is a narrow shelf.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
from uncom_tiago_exec.collision.collision_checker import CollisionChecker, densify
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.planning.joint_planner import JointPlanner
from uncom_tiago_exec.planning.options import PlannerOptions
from uncom_tiago_exec.planning.plan import MoveStep, Plan
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.types import SIDES, FloatArray, Obstacle

from uncom_sim.bench_planning.options import PROBLEMS, ProblemOptions
from uncom_sim.bench_planning.peers import ratios, run_peers
from uncom_sim.bench_planning.problems import IkProblem, Problem, check_time_us
from uncom_sim.bench_planning.scenes import TABLE_Z, pick_and_place, tabletop_solids
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions

LIGHT = PlannerOptions(rounds=1)
FULL = PlannerOptions(rounds=20, gain=0.01)  # until nothing is gained


def run_benchmark(
    seed: int, poses: int, plans: int, say: Callable[[str], None], *, problem_options: ProblemOptions = PROBLEMS
) -> dict[str, Any]:
    """Run all parts and return the benchmark's JSON object."""
    robot = RobotModel(tiago_urdf())
    start = home_positions(0.35, (0.0, -0.95), 0.02)
    result: dict[str, Any] = {"ik": inverse_kinematics(robot, start, poses, seed, problem_options=problem_options)}
    say(f"ik: {result['ik']}")
    problems = list(single_problems(robot, start, plans, seed))
    result["check_us"] = round(own_check_us(robot, start, seed, problem_options=problem_options), 2)
    say(f"check: {result['check_us']} us")
    result["plan"] = single_plans(problems, LIGHT, problem_options=problem_options)
    say(f"plan: {result['plan']}")
    result["plan_full"] = single_plans(problems, FULL, problem_options=problem_options)
    result["whole"] = whole_plans(robot, start, plans, seed)
    say(f"whole: {result['whole']}")
    result["shelf"] = single_plans(list(shelf_problems(robot, start, seed)), LIGHT, problem_options=problem_options)
    say(f"shelf: {result['shelf']}")
    result["peers"] = peers(robot, start, problems, poses, seed, problem_options=problem_options)
    result["ratios"] = ratios(result, result["peers"])
    say(f"ours as a multiple of: {result['ratios']}")
    return {**result, "seed": seed, "clock": "processor time of one thread"}


def peers(
    robot: RobotModel,
    start: dict[str, float],
    problems: list[Problem],
    poses: int,
    seed: int,
    *,
    problem_options: ProblemOptions = PROBLEMS,
) -> dict[str, Any]:
    """Give the same problems to other libraries."""
    groups = {side: robot.group(side, start) for side in SIDES}
    return run_peers(
        ik_problems(robot, start, poses, seed),
        lambda problem, q: _reaches(groups[problem.side], q, problem.target, problem_options.inset_m, problem_options),
        problems,
        check_states(robot, start, seed, problem_options=problem_options),
        start,
    )


def ik_problems(robot: RobotModel, start: dict[str, float], count: int, seed: int) -> list[IkProblem]:
    """Return poses that some configuration has, and other random configurations to begin at."""
    rng = np.random.default_rng([seed, 1])
    groups = [robot.group(side, start) for side in SIDES]
    found = []
    for i in range(count):
        group = groups[i % 2]
        target = group.forward(rng.uniform(group.lower, group.upper))
        found.append(IkProblem(group.side, target, rng.uniform(group.lower, group.upper)))
    return found


def inverse_kinematics(
    robot: RobotModel, start: dict[str, float], count: int, seed: int, *, problem_options: ProblemOptions = PROBLEMS
) -> dict[str, float]:
    """Solve poses that some configuration has, from other random configurations."""
    times, solved = [], 0
    groups = {side: robot.group(side, start) for side in SIDES}
    solvers = {side: IkSolver(group, seed) for side, group in groups.items()}
    for side, target, near in ik_problems(robot, start, count, seed):
        group, solver = groups[side], solvers[side]
        q, spent = None, []
        for _ in range(problem_options.rounds):
            began = time.thread_time()
            with suppress(ExecutionError):
                q = solver.solutions(target, [near], restarts=40)[0]
            spent.append(1000.0 * (time.thread_time() - began))
        times.append(min(spent))
        solved += q is not None and _reaches(group, q, target)
    return {"success": solved / count, **_percentiles(times)}


def _reaches(
    group: ArmGroup, q: FloatArray, target: FloatArray, beyond: float = 1e-9, options: ProblemOptions = PROBLEMS
) -> bool:
    """Tell whether a configuration is within 1 mm and 0.01 rad of a pose, and at most so far beyond the limits."""
    error = np.linalg.inv(group.forward(q)) @ target
    angle = float(np.arccos(np.clip((np.trace(error[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    inside = bool((q >= group.lower - beyond).all() and (q <= group.upper + beyond).all())
    return inside and float(np.linalg.norm(error[:3, 3])) < options.reach_m and angle < options.reach_rad


def _percentiles(milliseconds: list[float]) -> dict[str, float]:
    values = milliseconds or [float("nan")]
    return {
        "median_ms": round(float(np.median(values)), 4),
        "p95_ms": round(float(np.percentile(values, 95)), 4),
        "max_ms": round(float(np.max(values)), 4),
    }


def own_check_us(
    robot: RobotModel, start: dict[str, float], seed: int, *, problem_options: ProblemOptions = PROBLEMS
) -> float:
    """Return the time of one state check [us] in a cluttered scene, over states between tuck and table."""
    (checker, *_), states = check_states(robot, start, seed, problem_options=problem_options)
    return check_time_us(checker.is_free, states)


def check_states(
    robot: RobotModel, start: dict[str, float], seed: int, *, problem_options: ProblemOptions = PROBLEMS
) -> tuple[Problem, list[FloatArray]]:
    """Return a cluttered scene and free states (8,) between tuck and table."""
    rng = np.random.default_rng([seed, 2])
    group, solids = robot.group("left", start), tabletop_solids(rng, 6)
    checker = CollisionChecker(group, solids)
    home = group.clamp(group.vector(start))
    states = [
        q
        for q in group.clamp(home + rng.normal(scale=0.35, size=(4 * problem_options.checks, 8)))
        if checker.is_free(q)
    ]
    return Problem(checker, home, home, solids), states[: problem_options.checks]


def single_problems(robot: RobotModel, start: dict[str, float], count: int, seed: int) -> Iterator[Problem]:
    """Yield checker, start and goal: from tuck to above the table; the straight way there is not free."""
    rng = np.random.default_rng([seed, 3])
    made = 0
    while made < count:
        side = SIDES[made % 2]
        group = robot.group(side, start)
        home = group.clamp(group.vector(start))
        solids = tabletop_solids(rng, int(rng.integers(6, 13)))
        checker = _checker(group, solids, home)
        solver = IkSolver(group, seed)
        for _ in range(20):
            try:
                goal = solver.solutions(_pregrasp(rng, 1.0 if side == "left" else -1.0), [home], checker)[0]
            except ExecutionError:
                continue
            if checker.path_is_free(np.vstack([home, goal])):
                continue
            made += 1
            yield Problem(checker, home, goal, solids)
            break


def _checker(group: ArmGroup, solids: tuple[Obstacle, ...], home: FloatArray) -> CollisionChecker:
    """Return a checker for which the arm may be at home, whatever it is said to touch there."""
    checker = CollisionChecker(group, solids)
    if not checker.is_free(home):
        checker.lower_margins_at(home)
    return checker


def _pregrasp(rng: np.random.Generator, sign: float) -> FloatArray:
    """Return a hand pose (4, 4) 6 to 25 cm above the table that looks 30 to 90 degrees down."""
    pitch, yaw = rng.uniform(np.radians(30.0), np.pi / 2.0), rng.uniform(-0.8, 0.8)
    x, y = rng.uniform(0.5, 0.75), sign * rng.uniform(-0.05, 0.4)
    return _hand((x, y, TABLE_Z + 0.1 + rng.uniform(0.06, 0.25)), pitch, yaw)


def _hand(position: tuple[float, float, float], pitch: float, yaw: float) -> FloatArray:
    pose = np.eye(4)
    pose[:3, 0] = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    pose[:3, 1] = [-np.sin(yaw), np.cos(yaw), 0.0]
    pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
    pose[:3, 3] = position
    return pose


def shelf_problems(robot: RobotModel, start: dict[str, float], seed: int) -> Iterator[Problem]:
    """Yield ways of the left hand between two boards and two walls that stand on the table."""
    rng = np.random.default_rng([seed, 4])
    group = robot.group("left", start)
    boards = [((0.72, 0.25, TABLE_Z + 0.42), (0.3, 0.6, 0.02)), ((0.72, 0.56, TABLE_Z + 0.21), (0.3, 0.02, 0.42))]
    boards += [((0.72, -0.06, TABLE_Z + 0.21), (0.3, 0.02, 0.42)), ((0.88, 0.25, TABLE_Z + 0.21), (0.02, 0.6, 0.42))]
    solids = tuple(Obstacle("shelf", "box", size, make_upright_pose(np.array(at), 0.0)) for at, size in boards)
    home = group.clamp(group.vector(start))
    solids = (*tabletop_solids(rng, 0), *solids)
    checker = _checker(group, solids, home)
    solver = IkSolver(group, seed)
    for _ in range(10):
        pose = _hand((rng.uniform(0.56, 0.62), rng.uniform(0.12, 0.38), TABLE_Z + rng.uniform(0.14, 0.24)), 0.1, 0.0)
        try:
            yield Problem(checker, home, solver.solutions(pose, [home], checker)[0], solids)
        except ExecutionError:
            continue


def single_plans(
    problems: list[Problem], options: PlannerOptions, *, problem_options: ProblemOptions = PROBLEMS
) -> dict[str, float]:
    """Plan each problem; a success takes at most 1 s and ends at the goal."""
    times, solved, colliding = [], 0, 0
    for checker, home, goal, _ in problems:
        began = time.thread_time()
        try:
            path = JointPlanner(checker, options).plan(home, [goal])
        except ExecutionError:
            times.append(1000.0 * (time.thread_time() - began))
            continue
        times.append(1000.0 * (time.thread_time() - began))
        solved += times[-1] < 1000.0 * problem_options.plan_limit_s and bool(np.allclose(path[-1], goal, atol=1e-6))
        colliding += sum(not checker.is_free(q) for q in densify(path, 0.005))
    share = solved / max(len(problems), 1)
    return {"problems": len(problems), "success": share, **_percentiles(times), "recheck_colliding": colliding}


def whole_plans(robot: RobotModel, start: dict[str, float], count: int, seed: int) -> dict[str, Any]:
    """Plan whole pick-and-places in clutter."""
    rng = np.random.default_rng([seed, 5])
    times, motion, bound, reasons = [], [], [], []
    stages: dict[str, list[float]] = {}
    for i in range(count):
        task = pick_and_place(rng, int(rng.integers(6, 13)), 1.0 if i % 2 else -1.0)
        planner = ManipulationPlanner(robot, ExecutionConfig(seed=seed + 1))
        began = time.thread_time()
        try:
            plan = planner.plan(task, start)
            motion.append(plan.duration_s)
            bound.append(plan.shortest_s)
            _add_stages(stages, plan)
        except ExecutionError as error:
            reasons.append(str(error))
        times.append(time.thread_time() - began)
    return {
        "plans": count,
        "success": (count - len(reasons)) / max(count, 1),
        "median_s": round(float(np.median(times)), 4),
        "p95_s": round(float(np.percentile(times, 95)), 4),
        "motion_median_s": round(float(np.median(motion or [0.0])), 2),
        "motion_over_bound": round(float(np.median(np.array(motion) / np.array(bound))), 3) if motion else None,
        "motion_by_stage": {
            name: {"mean_s": round(spent / len(motion), 2), "over_bound": round(spent / least, 2)}
            for name, (spent, least) in stages.items()
        },
        "refused": reasons,
    }


def _add_stages(stages: dict[str, list[float]], plan: Plan) -> None:
    """Add a plan's time in motion, and the least time that its motions could take, to their stages [s]."""
    for step in plan.steps:
        if isinstance(step, MoveStep):
            total = stages.setdefault(step.stage.name.lower(), [0.0, 0.0])
            total[0] += step.trajectory.duration_s
            total[1] += step.shortest_s
