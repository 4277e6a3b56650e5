# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of torso and arm: damped least squares with the limits as an active set.

A joint at its limit whose step would leave it is taken out of the step (its column is removed) instead of being
clamped afterwards; the damping follows Levenberg and Marquardt (Nakamura and Hanafusa 1986; Sugihara 2011).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from uncom_tiago_exec.collision import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, UnreachableError
from uncom_tiago_exec.robot_model import ArmGroup
from uncom_tiago_exec.types import FloatArray

POSITION_TOLERANCE = 5e-4  # [m]
ROTATION_TOLERANCE = 5e-3  # [rad]


@dataclass(frozen=True, slots=True)
class IkOptions:
    """Effort: iterations of one descent, random restarts, and how far from start a solution should be kept apart."""

    iterations: int = 50
    restarts: int = 20
    stall: int = 5
    distinct: float = 0.3


class IkSolver:
    """Solves for the grasping frame of one group. The generator makes restarts repeatable."""

    def __init__(self, group: ArmGroup, seed: int = 0, options: IkOptions | None = None) -> None:
        """Keep the group; nothing is computed yet."""
        self.group = group
        self.options = options or IkOptions()
        self._rng = np.random.default_rng(seed)
        # the torso counts in metres: 0.1 m of it is as dear as 0.5 rad of a joint
        self._weight = np.array([0.04] + [1.0] * 7)

    def descend(self, target: FloatArray, start: FloatArray, iterations: int | None = None) -> FloatArray | None:
        """Return the solution (8,) that one descent from `start` finds for a pose (4, 4), or None."""
        group, model, data = self.group, self.group.model, self.group.data
        goal = pin.SE3(target)
        lower, upper = group.lower, group.upper
        q = np.clip(start, lower, upper)
        damping, best, stalled = 1e-4, np.inf, 0
        error, jacobian = self._linearise(q, goal)
        norm = float(error @ error)
        for _ in range(iterations or self.options.iterations):
            if np.abs(error[:3]).max() < POSITION_TOLERANCE / 2 and np.abs(error[3:]).max() < ROTATION_TOLERANCE / 2:
                return q
            step = self._step(q, error, jacobian, damping)
            candidate = np.clip(q + step, lower, upper)
            pin.framesForwardKinematics(model, data, candidate)
            new_error = np.asarray(pin.log6(data.oMf[group.tool].actInv(goal)).vector)
            new_norm = float(new_error @ new_error)
            if new_norm < norm:
                q, damping = candidate, max(damping * 0.2, 1e-7)
                error, jacobian = self._linearise(q, goal)
                norm = new_norm
            else:
                damping = min(damping * 8.0, 1.0)
            stalled = 0 if norm < 0.9 * best else stalled + 1
            best = min(best, norm)
            if stalled > self.options.stall:
                return None
        return None

    def _linearise(self, q: FloatArray, goal: pin.SE3) -> tuple[FloatArray, FloatArray]:
        group = self.group
        pin.computeJointJacobians(group.model, group.data, q)
        pin.updateFramePlacement(group.model, group.data, group.tool)
        error = np.asarray(pin.log6(group.data.oMf[group.tool].actInv(goal)).vector)
        jacobian = np.asarray(pin.getFrameJacobian(group.model, group.data, group.tool, pin.ReferenceFrame.LOCAL))
        return error, jacobian

    def _step(self, q: FloatArray, error: FloatArray, jacobian: FloatArray, damping: float) -> FloatArray:
        """Return the damped step; joints that would leave their limits are taken out, at most three times."""
        weight = self._weight
        low, high = q <= self.group.lower + 1e-9, q >= self.group.upper - 1e-9
        step = np.zeros(len(q))
        for _ in range(4):
            weighted = jacobian * weight
            gram = weighted @ jacobian.T
            gram.flat[::7] += damping
            _, solution, failed = dposv(gram, error)
            if failed:
                return np.zeros(len(q))
            step = weighted.T @ solution
            blocked = (low & (step < 0.0)) | (high & (step > 0.0))
            if not blocked.any():
                break
            weight = np.where(blocked, 0.0, weight)
        largest = float(np.abs(step).max())
        return step * min(1.0, 0.8 / largest) if largest > 0.8 else step

    def solutions(
        self,
        target: FloatArray,
        seeds: Iterable[FloatArray],
        checker: CollisionChecker | None = None,
        count: int = 1,
        restarts: int | None = None,
    ) -> list[FloatArray]:
        """Return up to `count` collision-free solutions, from the seeds first and then from random restarts.

        Raises:
            UnreachableError: no descent reached the pose.
            InCollisionError: poses were reached, each in collision.
        """
        if not self.group.within_reach(target):
            raise UnreachableError(self._far(target))
        found: list[FloatArray] = []
        blocked: list[FloatArray] = []
        for start in self._starts(tuple(seeds), self.options.restarts if restarts is None else restarts):
            q = self.descend(target, start)
            if q is None or any(np.abs(q - other).max() < self.options.distinct for other in found):
                continue
            if checker is not None and not checker.is_free(q):
                blocked.append(q)
                continue
            found.append(q)
            if len(found) >= count:
                break
        if found:
            return found
        if blocked and checker is not None:
            pairs = checker.touching(blocked[0])
            text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
            raise InCollisionError(f"the pose can only be reached through an obstacle ({text})", pairs)
        raise UnreachableError(self._far(target))

    def _far(self, target: FloatArray) -> str:
        position = ", ".join(f"{v:.2f}" for v in target[:3, 3])
        return f"the {self.group.side} arm does not reach ({position})"

    def _starts(self, seeds: Sequence[FloatArray], restarts: int) -> Iterable[FloatArray]:
        yield from seeds
        for _ in range(restarts):
            yield self._rng.uniform(self.group.lower, self.group.upper)
