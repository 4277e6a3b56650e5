# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of torso and arm.

For a few torso heights and first joints all postures come in closed form at once (closed_form.py); those inside the
limits are the solutions, the nearest to a seed and farthest from the limits first. Where none is, more are looked at,
and the nearest misses are drawn inside the limits by descent (descent.py). Arms of other build are solved by descent
from random starts alone.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, UnreachableError
from uncom_tiago_exec.kinematics.analytic_ik import AnalyticIk
from uncom_tiago_exec.kinematics.numerical_ik import Descent
from uncom_tiago_exec.kinematics.options import IK_SEARCH, IkSearchOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray

_LOG = logging.getLogger(__name__)


class IkSolver:
    """Solves for the grasping frame of one group. The generator makes restarts repeatable."""

    def __init__(self, group: ArmGroup, seed: int = 0, *, options: IkSearchOptions = IK_SEARCH) -> None:
        """Read the geometry of a group's arm; the seed makes the restarts repeatable."""
        self._options = options
        self.group = group
        self._detours = np.array(
            [[rise, turn] for rise in options.torso_detours_m for turn in options.shoulder_detours_rad]
        )
        self._rng = np.random.default_rng(seed)
        self._descent = Descent(group)
        self._closed: AnalyticIk | None = None
        try:
            self._closed = AnalyticIk(group.model, group.tool)
        except ValueError as error:
            _LOG.info("inverse kinematics by descent alone: %s", error)
        # a sequence that fills the square evenly (Roberts 2018), from the middle of the ranges on
        steps = np.arange(sum(self._options.rounds))[:, None] * [0.7548776662466927, 0.5698402909980532]
        shares = (0.5 + steps) % 1.0
        # what stands on a table is best reached from above
        shares[self._options.rounds[0] : self._options.rounds[0] + 40, 0] = 1.0
        self._samples = group.lower[:2] + shares * (group.upper - group.lower)[:2]
        # of each joint, as columns
        self._middle = 0.5 * (group.upper + group.lower)[:, None]
        self._half = 0.5 * (group.upper - group.lower)[:, None]
        self._per_range = 0.5 / self._half
        self._scale = 1.0 / group.velocity[:, None]

    def descend(self, target: FloatArray, start: FloatArray, iterations: int | None = None) -> FloatArray | None:
        """Return the solution (8,) that one descent from `start` finds for a pose (4, 4), or None."""
        return self._descent.descend(target, start, iterations)

    def along(self, poses: FloatArray, start: FloatArray) -> FloatArray | None:
        """Follow poses (N, 4, 4) from a configuration; (N, 8), or None if a descent had better try.

        Torso and first joint go evenly to where the last pose is reached with the least motion; they stay if they can.

        Raises:
            UnreachableError: the last pose, near the first and turned as it is, is not reached from around there.
        """
        if self._closed is None:
            return None
        path = self._along(poses, start, start[:2])
        if path is not None:
            return path
        ends = np.clip(start[:2] + self._detours, self.group.lower[:2], self.group.upper[:2])
        q = self._closed.postures(poses[-1], ends[:, 0], ends[:, 1]).reshape(8, -1)
        inside = (np.abs(q - self._middle) <= self._half).all(axis=0)
        if inside.any():
            good = q[:, inside]
            nearest = int(np.abs((good - start[:, None]) * self._scale).max(axis=0).argmin())
            return self._along(poses, start, good[:2, nearest])
        first, last = poses[0], poses[-1]
        if np.linalg.norm(last[:3, 3] - first[:3, 3]) < self._options.nearby_m and np.array_equal(
            last[:3, :3], first[:3, :3]
        ):
            raise UnreachableError(self._far(last))
        return None

    def _along(self, poses: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray | None:
        """Follow poses while torso and first joint go evenly to an end (2,); None where that leaves the limits."""
        if self._closed is None:
            return None
        lead = start[:2] + (np.arange(1, len(poses) + 1) / len(poses))[:, None] * (end - start[:2])
        q = self._closed.postures(poses, lead[:, 0], lead[:, 1])
        branch = int(np.nan_to_num(np.abs(q[:, :, 0] - start[:, None]).max(axis=0), nan=np.inf).argmin())
        path = np.ascontiguousarray(q[:, branch].T)
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
        """Return up to `count` collision-free solutions: those near the first seed and off the limits first.

        With restarts 0 the search is a quick one: what only few postures reach may be missed.

        Raises:
            UnreachableError: no posture reaches the pose.
            InCollisionError: poses were reached, each in collision.
        """
        if not self.group.within_reach(target):
            raise UnreachableError(self._far(target))
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
        raise UnreachableError(self._far(target))

    def _candidates(self, target: FloatArray, seeds: Sequence[FloatArray], restarts: int) -> Iterable[FloatArray]:
        """Yield solutions, the best of each round first."""
        if self._closed is not None:
            misses: list[FloatArray] = []
            begin = 0
            for size in self._options.rounds if restarts > 0 else self._options.rounds[:2]:
                pairs = self._samples[begin : begin + size]
                if begin == 0 and seeds:
                    pairs = np.vstack([[seed[:2] for seed in seeds], pairs])
                begin += size
                q = self._closed.postures(target, pairs[:, 0], pairs[:, 1]).reshape(8, -1)
                inside, missed = self._sort(q, seeds)
                yield from inside
                misses = missed
            if restarts == 0:
                return
            for start in misses:
                q_near = self.descend(target, start)
                if q_near is not None:
                    yield q_near
        for start in (*seeds, *self._rng.uniform(self.group.lower, self.group.upper, (restarts, 8))):
            q_found = self.descend(target, np.asarray(start))
            if q_found is not None:
                yield q_found

    def _sort(self, q: FloatArray, seeds: Sequence[FloatArray]) -> tuple[list[FloatArray], list[FloatArray]]:
        """Return the configurations of (8, M) inside the limits, best first, and the nearest misses, clamped."""
        off = np.abs(q - self._middle)
        inside = np.flatnonzero((off <= self._half).all(axis=0))
        best: list[FloatArray] = []
        if len(inside) > 0:
            good = q.take(inside, axis=1)
            edge = ((self._half - off.take(inside, axis=1)) * self._per_range).min(axis=0)  # of the nearer limit
            cost = np.maximum(0.0, 1.0 - edge * (1.0 / self._options.limit_margin))
            if seeds:
                cost += (np.abs(good - seeds[0][:, None]) * self._scale).max(axis=0)
            best = list(good.T[np.argsort(cost)])
        if q.shape[1] <= 8 * (self._options.rounds[0] + len(seeds)):
            return best, []
        # the nearest miss of each posture
        excess = np.nan_to_num((off - self._half).max(axis=0), nan=np.inf)
        excess[inside] = np.inf
        missed = excess.reshape(8, -1)
        nearest = np.argmin(missed, axis=1) + np.arange(8) * missed.shape[1]
        order = nearest[np.argsort(excess[nearest])]
        return best, [np.clip(q[:, i], self.group.lower, self.group.upper) for i in order if np.isfinite(excess[i])]

    def _far(self, target: FloatArray) -> str:
        position = ", ".join(f"{v:.2f}" for v in target[:3, 3])
        return f"the {self.group.side} arm does not reach ({position})"
