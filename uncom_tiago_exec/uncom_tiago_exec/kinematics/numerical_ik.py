# SPDX-License-Identifier: Apache-2.0
r"""Numerical inverse kinematics: weighted, damped least squares with the joint limits as an active set.

With the pose error e (6,) as the logarithm of the transform that remains, the Jacobian J (6, 8) and weights W of the
joints, a step is

$$\Delta q = W J^T (J W J^T + \lambda I)^{-1} e$$

(Nakamura and Hanafusa 1986), where the damping is reduced after a step that lessens the error and increased after
another one (Levenberg-Marquardt, for inverse kinematics Sugihara 2011). A joint at its limit whose step would leave the
range is taken out of the step, by weight 0, instead of being clamped afterwards.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from uncom_tiago_exec.kinematics.options import NUMERICAL_IK, NumericalIkOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray


class NumericalIk:
    """Iterative solver for the grasping frame of one group."""

    def __init__(self, group: ArmGroup, *, options: NumericalIkOptions = NUMERICAL_IK) -> None:
        """Solve for an arm group; it keeps to the limits of the group."""
        self._options = options
        self.group = group
        self._weight = np.array([options.torso_weight] + [1.0] * 7)

    def solve(self, target: FloatArray, start: FloatArray, iterations: int | None = None) -> FloatArray | None:
        """Return the configuration (8,) that iteration from a start leads to, or None if it does not converge.

        Args:
            target: pose of the grasping frame in base_footprint (4, 4).
            start: configuration (8,) to begin with.
            iterations: at most; those of the options if None.
        """
        group, model, data, options = self.group, self.group.model, self.group.data, self._options
        goal = pin.SE3(target)
        lower, upper = group.lower, group.upper
        q = np.clip(start, lower, upper)
        damping, best, stalled = options.initial_damping, np.inf, 0
        error, jacobian = self._linearise(q, goal)
        norm = float(error @ error)
        for _ in range(iterations or options.iterations):
            if (
                np.abs(error[:3]).max() < options.position_tolerance_m / 2
                and np.abs(error[3:]).max() < options.rotation_tolerance_rad / 2
            ):
                return q
            step = self._step(q, error, jacobian, damping)
            candidate = np.clip(q + step, lower, upper)
            pin.framesForwardKinematics(model, data, candidate)
            new_error = np.asarray(pin.log6(data.oMf[group.tool].actInv(goal)).vector)
            new_norm = float(new_error @ new_error)
            if new_norm < norm:
                q, damping = candidate, max(damping * options.damping_decrease, options.least_damping)
                error, jacobian = self._linearise(q, goal)
                norm = new_norm
            else:
                damping = min(damping * options.damping_increase, options.greatest_damping)
            stalled = 0 if norm < options.progress_share * best else stalled + 1
            best = min(best, norm)
            if stalled > options.stalled_iterations:
                return None
        return None

    def _linearise(self, q: FloatArray, goal: pin.SE3) -> tuple[FloatArray, FloatArray]:
        """Return the error (6,) of a configuration (8,), in the grasping frame, and the Jacobian (6, 8) there."""
        group = self.group
        pin.computeJointJacobians(group.model, group.data, q)
        pin.updateFramePlacement(group.model, group.data, group.tool)
        error = np.asarray(pin.log6(group.data.oMf[group.tool].actInv(goal)).vector)
        jacobian = np.asarray(pin.getFrameJacobian(group.model, group.data, group.tool, pin.ReferenceFrame.LOCAL))
        return error, jacobian

    def _step(self, q: FloatArray, error: FloatArray, jacobian: FloatArray, damping: float) -> FloatArray:
        """Return the damped step (8,); joints that would leave their limits are taken out, at most three times."""
        weight = self._weight
        low, high = q <= self.group.lower + 1e-9, q >= self.group.upper - 1e-9
        step = np.zeros(len(q))
        for _ in range(4):
            weighted = jacobian * weight
            gram = weighted @ jacobian.T
            gram.flat[::7] += damping  # the diagonal of a (6, 6)
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
