# SPDX-License-Identifier: Apache-2.0
"""Collision-free joint paths with OMPL's RRT-Connect (Kuffner and LaValle 2000) and shortcuts."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from uncom_tiago_exec.collision import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError
from uncom_tiago_exec.types import FloatArray

_LOG = logging.getLogger(__name__)
ou.setLogLevel(ou.LogLevel.LOG_ERROR)


@dataclass(frozen=True, slots=True)
class PlannerOptions:
    """Budgets [s] and resolutions [rad, or m] of a search.

    resolution is that of the search, recheck that of the last look at the whole path.
    """

    time_s: float = 1.0
    attempts: int = 3
    simplify_s: float = 0.05
    resolution: float = 0.03
    recheck: float = 0.005


class JointPlanner:
    """Plans for the group of a checker. Coordinates are scaled by joint speed, so that length is time."""

    def __init__(self, checker: CollisionChecker, options: PlannerOptions | None = None, seed: int = 1) -> None:
        """Set up the space; the checker decides validity."""
        self.checker = checker
        self.options = options or PlannerOptions()
        self._speed = checker.group.velocity
        # OMPL's generator is global and can be seeded once a process; later calls are ignored with a message
        self._seed = seed

    def plan(self, start: FloatArray, goals: Sequence[FloatArray]) -> FloatArray:
        """Return a path (N, 8) from start to the first of the goals that can be reached, nearest first.

        Raises:
            InCollisionError: the start is in collision.
            PlanningError: no goal was reached within the budget.
        """
        if not goals:
            raise PlanningError("there is no goal to plan to")
        group = self.checker.group
        begin = group.clamp(start)
        if not self.checker.is_free(begin):
            pairs = self.checker.relax_at(begin)
            if pairs:
                text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
                raise InCollisionError(f"the arm starts in collision ({text})", pairs)
        ordered = sorted(goals, key=lambda q: self.duration(np.vstack([begin, q])))
        for goal in ordered:
            straight = np.vstack([begin, goal])
            if self.checker.path_is_free(straight, self.options.recheck):
                return straight
        deadline = time.thread_time() + self.options.time_s
        for goal in ordered:
            path = self._search(begin, goal, deadline)
            if path is not None:
                return path
        raise PlanningError(f"the {group.side} arm found no free way in {self.options.time_s:.1f} s")

    def duration(self, path: FloatArray) -> float:
        """Return the time [s] a path takes at full joint speed without regard to acceleration."""
        return float((np.abs(np.diff(path, axis=0)) / self._speed).max(axis=1).sum())

    def _search(self, start: FloatArray, goal: FloatArray, deadline: float) -> FloatArray | None:
        resolution = self.options.resolution
        for _ in range(self.options.attempts):
            remaining = deadline - time.thread_time()
            if remaining <= 0.0:
                return None
            path = self._solve(start, goal, remaining, resolution)
            if path is None:
                return None
            if self.checker.path_is_free(path, self.options.recheck):
                return path
            resolution /= 3.0
        return None

    def _solve(self, start: FloatArray, goal: FloatArray, time_s: float, resolution: float) -> FloatArray | None:
        group, speed = self.checker.group, self._speed
        count = len(speed)
        space = ob.RealVectorStateSpace(count)
        bounds = ob.RealVectorBounds(count)
        for i in range(count):
            bounds.setLow(i, float(group.lower[i] / speed[i]))
            bounds.setHigh(i, float(group.upper[i] / speed[i]))
        space.setBounds(bounds)
        setup = og.SimpleSetup(space)
        buffer = np.empty(count)
        scale = [float(v) for v in speed]
        is_free = self.checker.is_free

        def valid(state: ob.State) -> bool:
            for i in range(count):
                buffer[i] = state[i] * scale[i]
            return bool(is_free(buffer))

        setup.setStateValidityChecker(valid)
        information = setup.getSpaceInformation()
        fraction = resolution / float(speed.max()) / float(space.getMaximumExtent())
        information.setStateValidityCheckingResolution(fraction)
        setup.setPlanner(og.RRTConnect(information))
        ends = []
        for q in (start, goal):
            state = information.allocState()
            for i in range(count):
                state[i] = float(q[i] / scale[i])
            ends.append(state)
        setup.setStartAndGoalStates(ends[0], ends[1])
        setup.solve(time_s)
        if not setup.haveExactSolutionPath():
            return None
        path = setup.getSolutionPath()
        self._simplify(setup, path)
        states = path.getStates()
        return np.array([[state[i] * scale[i] for i in range(count)] for state in states])

    def _simplify(self, setup: og.SimpleSetup, path: og.PathGeometric) -> None:
        """Shorten within the time budget: a few rounds of vertex removal and partial shortcuts."""
        simplifier = og.PathSimplifier(setup.getSpaceInformation())
        deadline = time.thread_time() + self.options.simplify_s  # a busy machine gets the same ways
        simplifier.reduceVertices(path)
        while time.thread_time() < deadline:
            length = path.length()
            simplifier.partialShortcutPath(path)
            simplifier.reduceVertices(path)
            if path.length() > 0.97 * length:
                break
