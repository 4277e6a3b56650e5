# SPDX-License-Identifier: Apache-2.0
"""The planning problems given to roboplan, in this process."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import time
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.link_pairs import disabled_pairs
from uncom_tiago_exec.robot.robot_model import package_directories
from uncom_tiago_exec.types import SIDES, FloatArray, Obstacle, Side

from uncom_sim.bench_planning.options import PROBLEMS, ROBOPLAN, ProblemOptions, RoboplanOptions
from uncom_sim.bench_planning.problems import (
    Checks,
    IkProblem,
    Problem,
    Reaches,
    check_time_us,
    judged_plans,
    locked_urdf,
)
from uncom_sim.robot.description import tiago_urdf

_GROUP = "arm"


def run_roboplan(
    poses: Sequence[IkProblem],
    reaches: Reaches,
    problems: Sequence[Problem],
    states: Checks,
    positions: dict[str, float],
    *,
    problem_options: ProblemOptions = PROBLEMS,
    roboplan_options: RoboplanOptions = ROBOPLAN,
) -> dict[str, Any] | str:
    """Return what roboplan does with the problems, or why it is not there."""
    if importlib.util.find_spec("roboplan") is None:
        return "not installed: it comes with ./uncom setup"
    return {
        "version": importlib.metadata.version("roboplan-core"),
        "ik": _ik(poses, reaches, positions, problem_options=problem_options, roboplan_options=roboplan_options),
        "check_us": round(_check_us(*states, positions), 2),
        "plan": _plans(problems, positions, roboplan_options=roboplan_options),
    }


class _Scene:
    """A roboplan scene of the robot with one arm as its group."""

    def __init__(
        self, side: Side, positions: dict[str, float], solids: Sequence[Obstacle], *, shapes: bool = True
    ) -> None:
        from roboplan import core  # noqa: PLC0415  (only where it is installed)

        self.names = list(group_joints(side))
        urdf = locked_urdf(tiago_urdf(), self.names, positions)
        if not shapes:
            urdf = _without_shapes(urdf)
        self.scene = core.Scene("bench", core.loadUrdfSceneDescriptionFromXml(urdf, package_directories()))
        self.scene.addGroup(_GROUP, self.names)
        self.scene.allowAdjacentLinkCollisions()
        self._add(core, solids)
        links = re.findall(r'<link name="([^"]+)"', urdf)
        known = [sorted(pair) for pair in disabled_pairs() if len(pair) > 1 and pair <= set(links)]
        self.scene.setCollisions([(a, b) for a, b in known], enable=False)

    def _add(self, core: Any, solids: Sequence[Obstacle]) -> None:
        colour = np.array([0.5, 0.5, 0.5, 1.0])
        names = [f"solid{k}" for k in range(len(solids))]
        for name, solid in zip(names, solids, strict=True):
            at = np.asfortranarray(solid.pose)
            if solid.shape == "box":
                self.scene.addBoxGeometry(name, "universe", core.Box(*solid.size), at, colour)
            else:
                self.scene.addCylinderGeometry(
                    name, "universe", core.Cylinder(solid.size[0] / 2.0, solid.size[2]), at, colour
                )
        # what stands still may stand on the other
        self.scene.setCollisions([(a, b) for i, a in enumerate(names) for b in names[i + 1 :]], enable=False)


def _without_shapes(urdf: str) -> str:
    """Return a description without any body: a solver that looks at none is quicker with it."""
    root = ET.fromstring(urdf)  # noqa: S314  (our own description)
    for link in root.iter("link"):
        for shape in (*link.findall("collision"), *link.findall("visual")):
            link.remove(shape)
    return ET.tostring(root, encoding="unicode")


def _ik(
    poses: Sequence[IkProblem],
    reaches: Reaches,
    positions: dict[str, float],
    *,
    problem_options: ProblemOptions = PROBLEMS,
    roboplan_options: RoboplanOptions = ROBOPLAN,
) -> dict[str, float]:
    from roboplan import core, simple_ik  # noqa: PLC0415

    scenes = {side: _Scene(side, positions, (), shapes=False) for side in SIDES}
    options = simple_ik.SimpleIkOptions(
        _GROUP,
        max_restarts=roboplan_options.restarts,
        step_size=1.0,
        damping=1e-3,
        max_iters=30,
        max_time=1.0,
        check_collisions=False,
    )
    solvers = {side: simple_ik.SimpleIk(scene.scene, options) for side, scene in scenes.items()}
    times, solved = [], 0
    for problem in poses:
        names = scenes[problem.side].names
        goal = core.CartesianConfiguration(
            "base_footprint", f"gripper_{problem.side}_grasping_frame", np.asfortranarray(problem.target)
        )
        near = core.JointConfiguration(names, problem.near)
        q, spent = None, []
        for _ in range(problem_options.rounds):
            found = core.JointConfiguration(names, problem.near.copy())
            began = time.thread_time()
            done = bool(solvers[problem.side].solveIk(goal, near, found))
            spent.append(1000.0 * (time.thread_time() - began))
            q = np.array(found.positions) if done else q
        times.append(min(spent))
        solved += q is not None and reaches(problem, q)
    return {"success": solved / max(len(poses), 1), "median_ms": round(float(np.median(times)), 4)}


def _check_us(problem: Problem, states: list[FloatArray], positions: dict[str, float]) -> float:
    from roboplan import core  # noqa: PLC0415

    scene = _Scene(problem.checker.group.side, positions, problem.solids)
    return check_time_us(core.SceneContext(scene.scene).hasCollisions, states)


def _plans(
    problems: Sequence[Problem], positions: dict[str, float], *, roboplan_options: RoboplanOptions = ROBOPLAN
) -> dict[str, Any]:
    from roboplan import core, rrt  # noqa: PLC0415

    times: list[float] = []
    paths: list[FloatArray | None] = []
    for k, (checker, start, goal, solids) in enumerate(problems):
        scene = _Scene(checker.group.side, positions, solids)
        planner = rrt.RRT(scene.scene, rrt.RRTOptions(_GROUP, max_planning_time=1.0, rrt_connect=True))
        planner.setRngSeed(k)
        shorter = core.PathShortcutter(
            scene.scene, core.PathShortcuttingOptions(_GROUP, max_iters=roboplan_options.shortcuts)
        )
        ends = [core.JointConfiguration(scene.names, q) for q in (start, goal)]
        began = time.thread_time()
        try:
            path = shorter.shortcut(planner.plan(*ends))
        except RuntimeError:
            path = None
        times.append(1000.0 * (time.thread_time() - began))
        there = path is not None and len(path.positions) > 1
        paths.append(np.array(path.positions) if there else None)
    return judged_plans(problems, paths, times)
