# SPDX-License-Identifier: Apache-2.0
"""Numerical inverse kinematics: damped least squares with the limits as an active set.

A joint at its limit whose step would leave it is taken out of the step (its column is removed) instead of being
clamped afterwards; the damping follows Levenberg and Marquardt (Nakamura and Hanafusa 1986; Sugihara 2011).
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from uncom_tiago_exec.kinematics.options import NUMERICAL_IK, NumericalIkOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray


class Descent:
    """Descends to poses of the grasping frame of one group."""

    def __init__(
        self, group: ArmGroup, iterations: int = 50, stall: int = 5, *, options: NumericalIkOptions = NUMERICAL_IK
    ) -> None:
        """Solve for an arm group; a descent ends after `iterations`, or after `stall` of them without progress."""
        self._options = options
        self.group = group
        self._iterations = iterations
        self._stall = stall
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
        for _ in range(iterations or self._iterations):
            if (
                np.abs(error[:3]).max() < self._options.position_tolerance_m / 2
                and np.abs(error[3:]).max() < self._options.rotation_tolerance_rad / 2
            ):
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
            if stalled > self._stall:
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
        limit = self._options.largest_step
        return step * min(1.0, limit / largest) if largest > limit else step
