# SPDX-License-Identifier: Apache-2.0
"""Collision-free joint paths by RRT-Connect and shortcuts.

The straight line to a goal is tried first. Otherwise OMPL's RRT-Connect (Kuffner and LaValle 2000) grows two random
trees, from start and goal, towards one another, and the path is shortened: vertices that straight lines can pass over
are removed, and random points of the path are connected directly.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError
from uncom_tiago_exec.planning.options import PLANNER, PlannerOptions
from uncom_tiago_exec.types import FloatArray

_LOG = logging.getLogger(__name__)
ou.setLogLevel(ou.LogLevel.LOG_ERROR)
ou.RNG.setSeed(1)  # seeds all generators of OMPL made later, so that a process plans repeatably


class _SegmentValidator(ob.MotionValidator):
    """Tells OMPL which straight lines between two states are free, by the checker's own test of segments."""

    def __init__(self, information: Any, checker: CollisionChecker) -> None:
        """Validate with a checker in the state space of OMPL's space information."""
        super().__init__(information)
        self._checker = checker
        self._speed = checker.group.velocity
        self._indices = range(len(self._speed))

    def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: N802  (OMPL calls it so)
        """Tell whether the straight line from one state to another is free."""
        start = np.array([first[i] for i in self._indices]) * self._speed
        end = np.array([second[i] for i in self._indices]) * self._speed
        return self._checker.segment_is_free(start, end)


class JointPlanner:
    """Plans paths for the group of a checker.

    Coordinates of the search are joint positions divided by the speed limits, so that lengths are durations [s].

    Attributes:
        checker: decides which configurations are free.
        options: budgets of the search.
    """

    def __init__(self, checker: CollisionChecker, options: PlannerOptions = PLANNER) -> None:
        """Plan with a checker and budgets."""
        self.checker = checker
        self.options = options
        self._speed = checker.group.velocity

    def plan(self, start: FloatArray, goals: Sequence[FloatArray]) -> FloatArray:
        """Return a path from a start to the first of the goals that can be reached, nearest first.

        Where the start does not keep the margins of the checker they are lowered to what it has.

        Args:
            start: configuration (8,).
            goals: configurations (8,).

        Returns:
            Waypoints (N, 8) between which straight lines are free.

        Raises:
            InCollisionError: the start is in collision.
            PlanningError: there is no goal, or none was reached in the time.
        """
        if not goals:
            raise PlanningError("there is no goal to plan to")
        group = self.checker.group
        begin = group.clamp(start)
        if not self.checker.is_free(begin):
            pairs = self.checker.lower_margins_at(begin)
            if pairs:
                text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
                raise InCollisionError(f"the arm starts in collision ({text})", pairs)
        ordered = sorted(goals, key=lambda q: self.duration(np.vstack([begin, q])))
        for goal in ordered:
            if self.checker.segment_is_free(begin, goal):
                return np.vstack([begin, goal])
        deadline = time.thread_time() + self.options.time_s
        for goal in ordered:
            path = self._solve(begin, goal, deadline - time.thread_time())
            if path is not None:
                return path
        raise PlanningError(f"the {group.side} arm found no free way in {self.options.time_s:.1f} s")

    def duration(self, path: FloatArray) -> float:
        """Return the time [s] that a path (N, 8) takes at full joint speed, without regard to acceleration."""
        return float((np.abs(np.diff(path, axis=0)) / self._speed).max(axis=1).sum())

    def _solve(self, start: FloatArray, goal: FloatArray, time_s: float) -> FloatArray | None:
        """Return a path (N, 8) between two configurations (8,), or None if none is found in the time [s]."""
        if time_s <= 0.0 or not self.checker.is_free(goal):
            return None
        group, speed = self.checker.group, self._speed
        count = len(speed)
        space = ob.RealVectorStateSpace(count)
        bounds = ob.RealVectorBounds(count)
        for i in range(count):
            bounds.setLow(i, float(group.lower[i] / speed[i]))
            bounds.setHigh(i, float(group.upper[i] / speed[i]))
        space.setBounds(bounds)
        setup = og.SimpleSetup(space)
        scale = [float(v) for v in speed]
        is_free = self.checker.is_free
        setup.setStateValidityChecker(lambda state: is_free(np.array([state[i] for i in range(count)]) * speed))
        information = setup.getSpaceInformation()
        motions = _SegmentValidator(information, self.checker)
        information.setMotionValidator(motions)
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
        """Shorten a path in place by rounds of shortcuts and vertex removal, while they gain enough."""
        simplifier = og.PathSimplifier(setup.getSpaceInformation())
        deadline = time.thread_time() + self.options.simplify_s
        simplifier.reduceVertices(path)
        for _ in range(self.options.rounds):
            length = path.length()
            simplifier.partialShortcutPath(path)
            simplifier.reduceVertices(path)
            if path.length() > (1.0 - self.options.gain) * length or time.thread_time() > deadline:
                break
