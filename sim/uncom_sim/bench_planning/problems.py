# SPDX-License-Identifier: Apache-2.0
"""What the planning benchmark gives to every library: problems, and the robot with one arm that moves."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation
from uncom_tiago_exec.collision.collision_checker import CollisionChecker, densify
from uncom_tiago_exec.types import FloatArray, Obstacle, Side

from uncom_sim.bench_planning.options import PROBLEMS, ProblemOptions

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


Reaches = Callable[[IkProblem, FloatArray], bool]
Checks = tuple[Problem, list[FloatArray]]


def check_time_us(
    check: Callable[[FloatArray], object], states: Sequence[FloatArray], *, options: ProblemOptions = PROBLEMS
) -> float:
    """Return the processor time of one call of a check of a state (8,) [us]."""
    spent = []
    for _ in range(options.rounds):
        began = time.thread_time()
        for q in states:
            check(q)
        spent.append(1e6 * (time.thread_time() - began) / max(len(states), 1))
    return min(spent)


def judged_plans(
    problems: Sequence[Problem],
    paths: Sequence[FloatArray | None],
    times_ms: Sequence[float],
    *,
    options: ProblemOptions = PROBLEMS,
) -> dict[str, Any]:
    """Return successes, times and what our checker says of paths (N, 8) that another library found, None if none."""
    solved = [(problem.checker, path) for problem, path in zip(problems, paths, strict=True) if path is not None]
    return {
        "problems": len(problems),
        "success": len(solved) / max(len(problems), 1),
        "median_ms": round(float(np.median(times_ms)), 3),
        "p95_ms": round(float(np.percentile(times_ms, 95)), 3),
        "recheck_inside_margins": sum(
            not checker.is_free(q) for checker, path in solved for q in densify(path, options.recheck_rad)
        ),
    }


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
