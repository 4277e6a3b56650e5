# SPDX-License-Identifier: Apache-2.0
"""The same planning problems given to other libraries, where they are installed: roboplan in this process.

mplib wants another numpy (1.26) than everything else here, so it cannot be loaded beside it and is only named.
Peers keep no margins and look at the meshes as they are; their paths are looked at again by our checker.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation
from uncom_tiago_exec.collision import CollisionChecker, densify
from uncom_tiago_exec.link_pairs import disabled_pairs
from uncom_tiago_exec.robot_model import group_joints, package_directories
from uncom_tiago_exec.types import SIDES, FloatArray, Obstacle, Side

from uncom_sim.robot.description import tiago_urdf

_GROUP = "arm"
_RESTARTS = 20
_SHORTCUTS = 200
_IGNORED = re.compile(r"caster|wheel|antenna|suspension|cover|sonar|mic")


class Problem(NamedTuple):
    """A way to plan: with what checker, from where, to where (8,), among which solids."""

    checker: CollisionChecker
    start: FloatArray
    goal: FloatArray
    solids: tuple[Obstacle, ...]


class IkProblem(NamedTuple):
    """A pose (4, 4) of one side's hand, and a configuration (8,) to begin at."""

    side: Side
    target: FloatArray
    near: FloatArray


def run_peers(
    poses: Sequence[IkProblem],
    reaches: Callable[[IkProblem, FloatArray], bool],
    problems: Sequence[Problem],
    states: tuple[Problem, list[FloatArray]],
    positions: dict[str, float],
) -> dict[str, Any]:
    """Return what each peer does with the same problems, or why it is not there."""
    found: dict[str, Any] = {"mplib": "not compared: it needs numpy 1.26, which nothing else here does"}
    if importlib.util.find_spec("roboplan") is None:
        found["roboplan"] = "not installed: uv pip install roboplan==0.7.0"
        return found
    found["roboplan"] = {
        "version": importlib.metadata.version("roboplan"),
        "ik": _ik(poses, reaches, positions),
        "check_us": round(_check_us(*states, positions), 2),
        "plan": _plans(problems, positions),
    }
    return found


def ratios(own: dict[str, Any], peers: dict[str, Any]) -> dict[str, Any]:
    """Return our medians as multiples of each peer's."""
    found = {}
    for name, peer in peers.items():
        if isinstance(peer, dict):
            found[name] = {
                "ik": round(own["ik"]["median_ms"] / peer["ik"]["median_ms"], 2),
                "check": round(own["check_us"] / peer["check_us"], 2),
                "plan": round(own["plan"]["median_ms"] / peer["plan"]["median_ms"], 2),
            }
    return found


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
        known = [sorted(pair) for pair in disabled_pairs() if len(pair) == 2 and pair <= set(links)]
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


def locked_urdf(urdf: str, movable: Sequence[str], positions: dict[str, float]) -> str:
    """Return a description in which all joints but the movable ones are fixed where they are.

    Wheels, casters and sensors lose their collision shapes, as in the model that our own checks use.
    """
    root = ET.fromstring(urdf)  # noqa: S314  (our own description)
    for link in root.iter("link"):
        if _IGNORED.search(link.get("name", "")):
            for shape in link.findall("collision"):
                link.remove(shape)
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        if name in movable or joint.get("type") == "fixed":
            continue
        _shift(joint, positions.get(name, 0.0))
        joint.set("type", "fixed")
        for part in joint.findall("mimic"):
            joint.remove(part)
    return ET.tostring(root, encoding="unicode")


def _without_shapes(urdf: str) -> str:
    """Return a description without any body: a solver that looks at none is quicker with it."""
    root = ET.fromstring(urdf)  # noqa: S314  (our own description)
    for link in root.iter("link"):
        for shape in (*link.findall("collision"), *link.findall("visual")):
            link.remove(shape)
    return ET.tostring(root, encoding="unicode")


def _shift(joint: ET.Element, value: float) -> None:
    """Move a joint's origin to where the joint stands."""
    origin, axis = joint.find("origin"), joint.find("axis")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    direction = np.array([float(v) for v in (axis.get("xyz", "1 0 0") if axis is not None else "1 0 0").split()])
    at = np.array([float(v) for v in origin.get("xyz", "0 0 0").split()])
    turn = Rotation.from_euler("xyz", [float(v) for v in origin.get("rpy", "0 0 0").split()])
    if joint.get("type") == "prismatic":
        at = at + turn.apply(direction * value)
    else:
        turn = turn * Rotation.from_rotvec(direction * value)
    origin.set("xyz", " ".join(repr(float(v)) for v in at))
    origin.set("rpy", " ".join(repr(float(v)) for v in turn.as_euler("xyz")))


def _ik(
    poses: Sequence[IkProblem], reaches: Callable[[IkProblem, FloatArray], bool], positions: dict[str, float]
) -> dict[str, float]:
    from roboplan import core, simple_ik  # noqa: PLC0415

    scenes = {side: _Scene(side, positions, (), shapes=False) for side in SIDES}
    options = simple_ik.SimpleIkOptions(
        _GROUP, max_restarts=_RESTARTS, step_size=1.0, damping=1e-3, max_iters=30, max_time=1.0,
        check_collisions=False,
    )  # fmt: skip
    solvers = {side: simple_ik.SimpleIk(scene.scene, options) for side, scene in scenes.items()}
    times, solved = [], 0
    for problem in poses:
        names = scenes[problem.side].names
        goal = core.CartesianConfiguration(
            "base_footprint", f"gripper_{problem.side}_grasping_frame", np.asfortranarray(problem.target)
        )
        near = core.JointConfiguration(names, problem.near)
        found = core.JointConfiguration(names, problem.near.copy())
        began = time.thread_time()
        done = solvers[problem.side].solveIk(goal, near, found)
        times.append(1000.0 * (time.thread_time() - began))
        solved += bool(done) and reaches(problem, np.array(found.positions))
    return {"success": solved / max(len(poses), 1), "median_ms": round(float(np.median(times)), 4)}


def _check_us(problem: Problem, states: list[FloatArray], positions: dict[str, float]) -> float:
    from roboplan import core  # noqa: PLC0415

    scene = _Scene(problem.checker.group.side, positions, problem.solids)
    context = core.SceneContext(scene.scene)
    began = time.thread_time()
    for q in states:
        context.hasCollisions(q)
    return 1e6 * (time.thread_time() - began) / max(len(states), 1)


def _plans(problems: Sequence[Problem], positions: dict[str, float]) -> dict[str, float]:
    from roboplan import core, rrt  # noqa: PLC0415

    times, solved, colliding = [], 0, 0
    for k, (checker, start, goal, solids) in enumerate(problems):
        scene = _Scene(checker.group.side, positions, solids)
        planner = rrt.RRT(scene.scene, rrt.RRTOptions(_GROUP, max_planning_time=1.0, rrt_connect=True))
        planner.setRngSeed(k)
        shorter = core.PathShortcutter(scene.scene, core.PathShortcuttingOptions(_GROUP, max_iters=_SHORTCUTS))
        ends = [core.JointConfiguration(scene.names, q) for q in (start, goal)]
        began = time.thread_time()
        try:
            path = shorter.shortcut(planner.plan(*ends))
        except RuntimeError:
            path = None
        times.append(1000.0 * (time.thread_time() - began))
        if path is not None and len(path.positions) > 1:
            solved += 1
            colliding += sum(not checker.is_free(q) for q in densify(np.array(path.positions), 0.005))
    return {
        "success": solved / max(len(problems), 1),
        "median_ms": round(float(np.median(times)), 3),
        "p95_ms": round(float(np.percentile(times, 95)), 3),
        "recheck_inside_margins": colliding,
    }
