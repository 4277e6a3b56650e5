# SPDX-License-Identifier: Apache-2.0
"""The planning problems given to mplib, which runs in a Python of its own; what it answers is judged here."""

from __future__ import annotations

import itertools
import json
import os
import re
import subprocess
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.link_pairs import adjacent_pairs, disabled_pairs, link_of_geometry
from uncom_tiago_exec.robot.robot_model import package_directories
from uncom_tiago_exec.types import SIDES, FloatArray, Obstacle

from uncom_sim.bench_planning.options import MPLIB, PROBLEMS, MplibOptions, ProblemOptions
from uncom_sim.bench_planning.problems import Checks, IkProblem, Problem, Reaches, judged_plans, locked_urdf
from uncom_sim.exceptions import WorkerError
from uncom_sim.robot.description import tiago_urdf

PYTHON = "UNCOM_PEERS_PYTHON"  # the environment variable that names the Python of ./uncom setup --peers
_WORKER = Path(__file__).with_name("peer_mplib_worker.py")


def run_mplib(
    poses: Sequence[IkProblem],
    reaches: Reaches,
    problems: Sequence[Problem],
    states: Checks,
    positions: dict[str, float],
    *,
    mplib_options: MplibOptions = MPLIB,
    problem_options: ProblemOptions = PROBLEMS,
) -> dict[str, Any] | str:
    """Return what mplib does with the problems, or why it does nothing."""
    python = os.environ.get(PYTHON, "")
    if not python:
        return "not compared: it needs numpy 1.26, an environment of its own; ./uncom setup --peers makes it"
    try:
        with tempfile.TemporaryDirectory(prefix="uncom_mplib_") as folder:
            job = _write_job(
                Path(folder),
                poses,
                problems,
                states,
                positions,
                mplib_options=mplib_options,
                problem_options=problem_options,
            )
            answer = _ask(python, job, mplib_options=mplib_options)
        return judged(answer, poses, reaches, problems, mplib_options=mplib_options)
    except (WorkerError, OSError) as error:
        return f"not compared: {error}"


def _write_job(
    folder: Path,
    poses: Sequence[IkProblem],
    problems: Sequence[Problem],
    states: Checks,
    positions: dict[str, float],
    *,
    mplib_options: MplibOptions = MPLIB,
    problem_options: ProblemOptions = PROBLEMS,
) -> Path:
    """Write descriptions and problems for the worker into a folder; return the job's file."""
    problem, free = states
    job = {
        "seed": mplib_options.seed,
        "rounds": problem_options.rounds,
        "budget_s": mplib_options.budget_s,
        "plan_limit_s": PROBLEMS.plan_limit_s,
        "arms": write_arms(folder, positions),
        "ik": [{"side": side, "target": target.tolist(), "near": near.tolist()} for side, target, near in poses],
        "check": {
            "side": problem.checker.group.side,
            "solids": _solids(problem.solids),
            "states": [q.tolist() for q in free],
        },
        "plans": [
            {
                "side": checker.group.side,
                "start": start.tolist(),
                "goal": goal.tolist(),
                "solids": _solids(solids),
            }
            for checker, start, goal, solids in problems
        ],
    }
    path = folder / "job.json"
    path.write_text(json.dumps(job), encoding="utf-8")
    return path


def _solids(solids: Sequence[Obstacle]) -> list[dict[str, Any]]:
    return [{"shape": solid.shape, "size": list(solid.size), "pose": solid.pose.tolist()} for solid in solids]


def write_arms(folder: Path, positions: dict[str, float]) -> dict[str, dict[str, Any]]:
    """Write URDF and SRDF of the robot with one arm that moves, for each side; return what to know of them.

    mplib takes mesh names as relative to the URDF, so the packages that hold them appear beside it as links.
    """
    found: dict[str, dict[str, Any]] = {}
    for side in SIDES:
        urdf = locked_urdf(tiago_urdf(), group_joints(side), positions)
        (folder / f"{side}.srdf").write_text(srdf(urdf), encoding="utf-8")
        (folder / f"{side}.urdf").write_text(_with_meshes_beside(urdf, folder), encoding="utf-8")
        found[side] = {
            "urdf": f"{side}.urdf",
            "srdf": f"{side}.srdf",
            "hand": f"gripper_{side}_grasping_frame",
            "joints": list(group_joints(side)),
        }
    return found


def _with_meshes_beside(urdf: str, folder: Path) -> str:
    """Return a description without pictures whose meshes are found in a folder, and link them into it."""
    root = ET.fromstring(urdf)  # noqa: S314  (our own description)
    for link in root.iter("link"):
        for picture in link.findall("visual"):
            link.remove(picture)
    text = ET.tostring(root, encoding="unicode")
    for package in set(re.findall(r'"package://([^/"]+)/', text)):
        place = next((Path(p) / package for p in package_directories() if (Path(p) / package).is_dir()), None)
        if place is not None and not (folder / package).exists():
            (folder / package).symlink_to(place)
    return text.replace('"package://', '"')


def srdf(urdf: str) -> str:
    """Return an SRDF that allows the contacts that our own checks do not look at."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = pin.buildModelFromXML(urdf)
        geometry = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.COLLISION, package_directories())
    skipped = disabled_pairs() | adjacent_pairs(model, geometry)
    links = sorted({link_of_geometry(shape.name) for shape in geometry.geometryObjects})
    root = ET.Element("robot", name=ET.fromstring(urdf).get("name", "robot"))  # noqa: S314  (our own description)
    for a, b in itertools.combinations(links, 2):
        if frozenset((a, b)) in skipped:
            ET.SubElement(root, "disable_collisions", link1=a, link2=b, reason="Never")
    return ET.tostring(root, encoding="unicode")


def _ask(python: str, job: Path, *, mplib_options: MplibOptions = MPLIB) -> dict[str, Any]:
    """Run the worker and return its answer.

    Raises:
        WorkerError: it cannot be started, fails, takes too long, or answers something else than JSON.
    """
    answer = job.with_name("answer.json")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "LD_LIBRARY"))}
    command = [python, "-I", str(_WORKER), str(job), str(answer)]
    try:
        done = subprocess.run(  # noqa: S603  (our own worker)
            command,
            env={**kept, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            timeout=mplib_options.budget_s + mplib_options.patience_s,
            check=False,
        )
    except OSError as error:
        raise WorkerError(f"its Python cannot be started: {python}: {error.strerror}") from error
    except subprocess.TimeoutExpired as error:
        raise WorkerError(f"it had not answered after {error.timeout:.0f} s") from error
    if done.returncode != 0:
        raise WorkerError(f"its process ended with status {done.returncode}: {_last_words(done.stderr)}")
    try:
        found = json.loads(answer.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise WorkerError("its process left no answer that can be read") from error
    if not isinstance(found, dict):
        raise WorkerError("its process left no answer that can be read")
    return found


def _last_words(text: str) -> str:
    """Return the line that names the last error, else the last line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()] or ["it said nothing"]
    return next((line for line in reversed(lines) if re.match(r"[\w.]*(Error|Exception)\b", line)), lines[-1])


def judged(
    answer: dict[str, Any],
    poses: Sequence[IkProblem],
    reaches: Reaches,
    problems: Sequence[Problem],
    *,
    mplib_options: MplibOptions = MPLIB,
) -> dict[str, Any]:
    """Return what our own kinematics and checker say of the worker's configurations (8,) and paths (N, 8).

    What the worker had no time for is counted as left out, not as failed.

    Raises:
        WorkerError: the answer lacks parts, or nothing was done in time.
    """
    try:
        times, found = [float(t) for t in answer["ik"]["ms"]], [_array(q, 1) for q in answer["ik"]["q"]]
        paths, spent = [_array(path, 2) for path in answer["plan"]["paths"]], answer["plan"]["ms"]
        if not times or not spent:
            raise WorkerError(f"nothing was done in {mplib_options.budget_s:.0f} s")
        solved = sum(q is not None and reaches(p, q) for p, q in zip(poses[: len(times)], found, strict=True))
        ik = {"poses": len(times), "success": solved / len(times), "median_ms": round(float(np.median(times)), 4)}
        return {
            "version": str(answer["version"]),
            "ik": ik,
            "check_us": round(float(answer["check"]["us"]), 2),
            "check_colliding": int(answer["check"]["colliding"]),
            "plan": judged_plans(problems[: len(spent)], paths, spent),
            "left_out": {"poses": len(poses) - len(times), "plans": len(problems) - len(spent)},
        }
    except (KeyError, TypeError, ValueError) as error:
        raise WorkerError(f"its answer cannot be used: {type(error).__name__}: {error}") from error


def _array(values: Any, dimensions: int) -> FloatArray | None:
    """Return joint vectors (8,) or (N, 8) as an array; None stays None."""
    if values is None:
        return None
    array = np.array(values, dtype=float)
    if array.ndim != dimensions or array.shape[-1] != len(group_joints("left")):
        raise ValueError(f"joint vectors of shape {array.shape}")
    return array
