# SPDX-License-Identifier: Apache-2.0
"""Solves planning problems with mplib: `python peer_mplib_worker.py JOB.json ANSWER.json`.

It runs in an environment of its own (`./uncom setup --peers`), so it knows nothing of this project but the job that
`peer_mplib.py` writes. Times are processor time of one thread; nothing is judged here.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mplib
import numpy as np
from mplib.collision_detection import fcl


@dataclass(frozen=True)
class SolverOptions:
    """How mplib solves; here and not in options.py, as this file runs without our packages."""

    restarts: int = 20
    tolerance: float = 1e-4  # of the closed loop: well inside 1 mm and 0.01 rad
    step: float = 1.0
    iterations: int = 100
    extension_rad: float = 1.9  # of one extension; the default of 0.1 takes four times as long


SOLVER = SolverOptions()


class Arm:
    """The robot with one arm that moves, and solids around it that can be exchanged."""

    def __init__(self, folder: Path, about: dict[str, Any]) -> None:
        """Load URDF and SRDF from a folder."""
        self.planner = mplib.Planner(str(folder / about["urdf"]), about["hand"], srdf=str(folder / about["srdf"]))
        names = [self.planner.user_joint_names[i] for i in self.planner.move_group_joint_indices]
        if names != about["joints"]:
            raise ValueError(f"joints in another order: {', '.join(names)}")
        self.world = self.planner.planning_world
        self._solids: list[str] = []

    def surround(self, solids: list[dict[str, Any]]) -> None:
        """Put these solids in place of those before: boxes and cylinders with size (3,) [m] and pose (4, 4)."""
        for name in self._solids:
            self.world.remove_object(name)
        self._solids = [f"solid{k}" for k in range(len(solids))]
        for name, solid in zip(self._solids, solids, strict=True):
            x, _, z = solid["size"]
            shape = fcl.Box(solid["size"]) if solid["shape"] == "box" else fcl.Cylinder(x / 2.0, z)
            pose = mplib.Pose(np.array(solid["pose"]))
            self.world.add_object(fcl.FCLObject(name, pose, [fcl.CollisionObject(shape)], [mplib.Pose()]))

    def solve(self, target: Any, near: Any) -> Any:
        """Return a configuration (8,) for a pose of the hand, None if no try arrives."""
        model, limits, q = self.planner.pinocchio_model, self.planner.joint_limits, near
        for _ in range(SOLVER.restarts + 1):
            found, done, _ = model.compute_IK_CLIK_JL(
                self.planner.move_group_link_id,
                target,
                q,
                limits[:, 0],
                limits[:, 1],
                SOLVER.tolerance,
                SOLVER.iterations,
                SOLVER.step,
            )
            if done:
                return found
            q = model.get_random_configuration()
        return None

    def plan(self, start: Any, goal: Any, limit_s: float) -> Any:
        """Return a simplified path (N, 8), None if none is found in time; no times along it."""
        self.planner.robot.set_qpos(start, True)
        status, path = self.planner.planner.plan(start, [goal], time=limit_s, range=SOLVER.extension_rad, simplify=True)
        return path if status == "Exact solution" else None


def poses(arms: dict[str, Arm], job: dict[str, Any], until: float) -> dict[str, Any]:
    """Solve poses until the clock says stop; each time [ms] is the least of some rounds."""
    times, found = [], []
    for problem in job["ik"]:
        if time.monotonic() > until:
            break
        target, near, spent, q = mplib.Pose(np.array(problem["target"])), np.array(problem["near"]), [], None
        for _ in range(job["rounds"]):
            began = time.thread_time()
            solved = arms[problem["side"]].solve(target, near)
            spent.append(1000.0 * (time.thread_time() - began))
            q = solved if solved is not None else q
        times.append(min(spent))
        found.append(None if q is None else np.asarray(q).tolist())
    return {"ms": times, "q": found}


def checks(arms: dict[str, Arm], job: dict[str, Any]) -> dict[str, Any]:
    """Look at all states; the time of one [us] is the least of some rounds."""
    arm, states = arms[job["check"]["side"]], [np.array(q) for q in job["check"]["states"]]
    arm.surround(job["check"]["solids"])
    spent, colliding = [], 0
    for _ in range(job["rounds"]):
        colliding = 0
        began = time.thread_time()
        for q in states:
            arm.world.set_qpos_all(q)
            colliding += arm.world.is_state_colliding()
        spent.append(1e6 * (time.thread_time() - began) / max(len(states), 1))
    return {"us": min(spent), "colliding": colliding}


def plans(arms: dict[str, Arm], job: dict[str, Any], until: float) -> dict[str, Any]:
    """Plan until the clock says stop; times in ms."""
    times, paths = [], []
    for problem in job["plans"]:
        if time.monotonic() > until:
            break
        arm, start, goal = arms[problem["side"]], np.array(problem["start"]), np.array(problem["goal"])
        arm.surround(problem["solids"])
        began = time.thread_time()
        path = arm.plan(start, goal, job["plan_limit_s"])
        times.append(1000.0 * (time.thread_time() - began))
        paths.append(None if path is None else np.asarray(path).tolist())
    return {"ms": times, "paths": paths}


def main(job_file: str, answer_file: str) -> None:
    """Do the whole job; poses get at most half of its time."""
    began = time.monotonic()
    job = json.loads(Path(job_file).read_text(encoding="utf-8"))
    mplib.set_global_seed(job["seed"])
    with contextlib.redirect_stdout(sys.stderr):
        arms = {side: Arm(Path(job_file).parent, about) for side, about in job["arms"].items()}
        answer = {
            "version": importlib.metadata.version("mplib"),
            "ik": poses(arms, job, began + job["budget_s"] / 2.0),
            "check": checks(arms, job),
            "plan": plans(arms, job, began + job["budget_s"]),
        }
    Path(answer_file).write_text(json.dumps(answer), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
