# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of torso and arm, with limits, preferences and collision checks.

The closed form (analytic_ik.py) gives all postures for pairs of torso height and first joint. The pairs are sampled in
rounds; postures inside the limits are solutions, those near a seed and far from the limits first. Where a round has
none the next one samples more, and in the end the nearest misses are drawn inside the limits by the numerical solver
(numerical_ik.py). Arms for which there is no closed form are solved numerically from random starts alone.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, RobotModelError, UnreachableError
from uncom_tiago_exec.kinematics.analytic_ik import AnalyticIk
from uncom_tiago_exec.kinematics.numerical_ik import NumericalIk
from uncom_tiago_exec.kinematics.options import (
    ANALYTIC_IK,
    IK_SEARCH,
    NUMERICAL_IK,
    AnalyticIkOptions,
    IkSearchOptions,
    NumericalIkOptions,
)
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray

_LOG = logging.getLogger(__name__)


def low_discrepancy_points(count: int) -> FloatArray:
    r"""Return points (count, 2) that fill the unit square evenly, in every prefix too, from its middle on.

    They are the R2 sequence of Roberts (2018), $(0.5 + k (1/g, 1/g^2)) \bmod 1$ with the plastic number g, the real
    solution of $g^3 = g + 1$.
    """
    plastic_number = 1.324717957244746
    steps = np.arange(count)[:, None] * [1.0 / plastic_number, 1.0 / plastic_number**2]
    return np.asarray((0.5 + steps) % 1.0)


class IkSolver:
    """Solves for the grasping frame of one group."""

    def __init__(
        self,
        group: ArmGroup,
        seed: int = 0,
        *,
        options: IkSearchOptions = IK_SEARCH,
        analytic_options: AnalyticIkOptions = ANALYTIC_IK,
        numerical_options: NumericalIkOptions = NUMERICAL_IK,
    ) -> None:
        """Prepare the solvers and the sampled pairs of torso height and first joint.

        Args:
            group: torso and arm.
            seed: of the random starts of the numerical solver.
            options: numbers that tune the search.
            analytic_options: numbers that tune the closed form.
            numerical_options: numbers that tune the numerical solver.
        """
        self._options = options
        self.group = group
        self._detours = np.array(
            [[rise, turn] for rise in options.torso_detours_m for turn in options.shoulder_detours_rad]
        )
        self._rng = np.random.default_rng(seed)
        self._numerical = NumericalIk(group, options=numerical_options)
        self._analytic: AnalyticIk | None = None
        try:
            self._analytic = AnalyticIk(group.model, group.tool, options=analytic_options)
        except RobotModelError as error:
            _LOG.info("inverse kinematics by descent alone: %s", error)
        shares = low_discrepancy_points(sum(options.rounds))
        shares[options.rounds[0] : options.rounds[0] + options.raised_samples, 0] = 1.0
        self._samples = group.lower[:2] + shares * (group.upper - group.lower)[:2]
        # of each joint, as columns (8, 1)
        self._middle = 0.5 * (group.upper + group.lower)[:, None]
        self._half_range = 0.5 * (group.upper - group.lower)[:, None]
        self._per_range = 0.5 / self._half_range
        self._per_speed = 1.0 / group.velocity[:, None]

    def solve_numerically(
        self, target: FloatArray, start: FloatArray, iterations: int | None = None
    ) -> FloatArray | None:
        """Return the solution (8,) for a pose (4, 4) that iteration from `start` (8,) leads to, or None."""
        return self._numerical.solve(target, start, iterations)

    def track_poses(self, poses: FloatArray, start: FloatArray) -> FloatArray | None:
        """Return configurations (N, 8) that take the grasping frame through poses (N, 4, 4), by the closed form.

        Torso and first joint change evenly from those of the start to values with which the last pose is reached, by
        the least motion; they stay as they are if that is possible. The posture is the one nearest to the start.

        Args:
            poses: in base_footprint, close to one another.
            start: configuration (8,) before the first of them.

        Returns:
            The path, or None where a limit is left on the way or there is no closed form: a numerical solver, which
            moves all joints freely, may still find one.

        Raises:
            UnreachableError: the last pose, near the first and of the same rotation, cannot be reached from there.
        """
        if self._analytic is None:
            return None
        path = self._track_towards(poses, start, start[:2])
        if path is not None:
            return path
        ends = np.clip(start[:2] + self._detours, self.group.lower[:2], self.group.upper[:2])
        q = self._analytic.postures(poses[-1], ends[:, 0], ends[:, 1]).reshape(8, -1)
        inside = (np.abs(q - self._middle) <= self._half_range).all(axis=0)
        if inside.any():
            solutions = q[:, inside]
            nearest = int(np.abs((solutions - start[:, None]) * self._per_speed).max(axis=0).argmin())
            return self._track_towards(poses, start, solutions[:2, nearest])
        first, last = poses[0], poses[-1]
        if np.linalg.norm(last[:3, 3] - first[:3, 3]) < self._options.nearby_m and np.array_equal(
            last[:3, :3], first[:3, :3]
        ):
            raise UnreachableError(self._unreachable_text(last))
        return None

    def _track_towards(self, poses: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray | None:
        """Track poses while torso and first joint change evenly to `end` (2,); None where a limit is left."""
        if self._analytic is None:
            return None
        parameters = start[:2] + (np.arange(1, len(poses) + 1) / len(poses))[:, None] * (end - start[:2])
        q = self._analytic.postures(poses, parameters[:, 0], parameters[:, 1])
        posture = int(np.nan_to_num(np.abs(q[:, :, 0] - start[:, None]).max(axis=0), nan=np.inf).argmin())
        path = np.ascontiguousarray(q[:, posture].T)
        inside = (path >= self.group.lower - 1e-9) & (path <= self.group.upper + 1e-9)
        return path if bool(inside.all()) else None

    def solutions(
        self,
        target: FloatArray,
        seeds: Iterable[FloatArray],
        checker: CollisionChecker | None = None,
        count: int = 1,
        restarts: int | None = None,
    ) -> list[FloatArray]:
        """Return up to `count` distinct solutions (8,), those near the first seed and off the limits first.

        Args:
            target: pose of the grasping frame in base_footprint (4, 4).
            seeds: configurations (8,) whose torso height and first joint are tried first.
            checker: solutions have to be free of collisions according to it.
            count: greatest number of solutions.
            restarts: random starts of the numerical solver; those of the options if None. With 0 the search is a
                quick one, without the last round: it may miss poses that few postures reach.

        Raises:
            UnreachableError: no posture reaches the pose.
            InCollisionError: each solution found is in collision.
        """
        if not self.group.within_reach(target):
            raise UnreachableError(self._unreachable_text(target))
        found: list[FloatArray] = []
        blocked: FloatArray | None = None
        for q in self._candidates(target, tuple(seeds), self._options.restarts if restarts is None else restarts):
            if any(np.abs(q - other).max() < self._options.distinct for other in found):
                continue
            if checker is not None and not checker.is_free(q):
                blocked = q if blocked is None else blocked
                continue
            found.append(q)
            if len(found) >= count:
                break
        if found:
            return found
        if blocked is not None and checker is not None:
            pairs = checker.touching(blocked)
            text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
            raise InCollisionError(f"the pose can only be reached through an obstacle ({text})", pairs)
        raise UnreachableError(self._unreachable_text(target))

    def _candidates(self, target: FloatArray, seeds: Sequence[FloatArray], restarts: int) -> Iterable[FloatArray]:
        """Yield solutions (8,) inside the limits, round by round, the best of each round first."""
        if self._analytic is not None:
            misses: list[FloatArray] = []
            begin = 0
            for size in self._options.rounds if restarts > 0 else self._options.rounds[:2]:
                pairs = self._samples[begin : begin + size]
                if begin == 0 and seeds:
                    pairs = np.vstack([[seed[:2] for seed in seeds], pairs])
                begin += size
                q = self._analytic.postures(target, pairs[:, 0], pairs[:, 1]).reshape(8, -1)
                inside, misses = self._rank(q, seeds)
                yield from inside
            if restarts == 0:
                return
            for start in misses:
                drawn_inside = self.solve_numerically(target, start)
                if drawn_inside is not None:
                    yield drawn_inside
        for start in (*seeds, *self._rng.uniform(self.group.lower, self.group.upper, (restarts, 8))):
            solution = self.solve_numerically(target, np.asarray(start))
            if solution is not None:
                yield solution

    def _rank(self, q: FloatArray, seeds: Sequence[FloatArray]) -> tuple[list[FloatArray], list[FloatArray]]:
        """Sort postures (8, M) into solutions and misses.

        Returns:
            The configurations (8,) inside the limits in the order of their cost: the time at full speed from the first
            seed, plus up to 1 near a limit. And, of a round after the first, for each of the eight postures the one
            that leaves the limits least, clamped.
        """
        off_middle = np.abs(q - self._middle)
        inside = np.flatnonzero((off_middle <= self._half_range).all(axis=0))
        best: list[FloatArray] = []
        if len(inside) > 0:
            solutions = q.take(inside, axis=1)
            # distance from the nearest limit, as share of the range
            limit_distance = ((self._half_range - off_middle.take(inside, axis=1)) * self._per_range).min(axis=0)
            cost = np.maximum(0.0, 1.0 - limit_distance * (1.0 / self._options.limit_margin))
            if seeds:
                cost += (np.abs(solutions - seeds[0][:, None]) * self._per_speed).max(axis=0)
            best = list(solutions.T[np.argsort(cost)])
        if q.shape[1] <= 8 * (self._options.rounds[0] + len(seeds)):
            return best, []
        excess = np.nan_to_num((off_middle - self._half_range).max(axis=0), nan=np.inf)
        excess[inside] = np.inf
        by_posture = excess.reshape(8, -1)
        nearest = np.argmin(by_posture, axis=1) + np.arange(8) * by_posture.shape[1]
        order = nearest[np.argsort(excess[nearest])]
        return best, [np.clip(q[:, i], self.group.lower, self.group.upper) for i in order if np.isfinite(excess[i])]

    def _unreachable_text(self, target: FloatArray) -> str:
        """Return what is said of a pose (4, 4) that is out of reach."""
        position = ", ".join(f"{v:.2f}" for v in target[:3, 3])
        return f"the {self.group.side} arm does not reach ({position})"
