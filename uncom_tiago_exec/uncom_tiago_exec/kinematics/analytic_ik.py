# SPDX-License-Identifier: Apache-2.0
r"""Closed-form inverse kinematics of a TIAGo arm on its torso: all postures for given redundant joints.

Torso and arm have eight joints for the six coordinates of a pose. The two redundant ones are taken as parameters: the
torso height $h$ and the first joint $q_1$. The other six follow, as the axes of joints 2 and 3 meet at right angles in
a point $S$ (shoulder) and those of joints 5, 6 and 7 in a point $W$ (wrist), so that position and orientation decouple
(Pieper 1968). Joint $i$ is a fixed placement on the link before it, with rotation $F_i$, and a rotation $R_z(q_i)$.

1. From the pose follow the rotation $R$ of link 7 and the position of $W$ in the base; from $h$ and $q_1$ the frame
   $A$ in which joint 2 turns, with rotation $R_A$, and $S$. Let $v = W - S$ in $A$.
2. In the frame of link 3 the same vector depends on joint 4 alone, $u = b + F_4 R_z(q_4) w$, and has the same length:
   $$|v|^2 = |u|^2 = c + a \cos(q_4 - \varphi), \quad q_4 = \varphi \pm \arccos((|v|^2 - c) / a).$$
3. $v = R_z(q_2) F_3 R_z(q_3) u$. Joint 2 does not change the component along its own axis. With $(f_1, f_2, f_3)$ the
   third row of $F_3$, $f$ and $\alpha$ length and angle of $(f_1, f_2)$, $\rho$ and $\beta$ those of $(u_x, u_y)$:
   $$v_z = f \rho \cos(q_3 + \beta - \alpha) + f_3 u_z,
   \quad q_3 = \alpha \pm \arccos((v_z - f_3 u_z) / (f \rho)) - \beta.$$
4. With $p = F_3 R_z(q_3) u$, joint 2 turns $p$ to $v$: $q_2 = \mathrm{atan2}(v_y, v_x) - \mathrm{atan2}(p_y, p_x)$.
5. What remains is the rotation of a ZYZ wrist (Paul 1981, chapter 3),
   $$M = (R_z(q_2) F_3 R_z(q_3) F_4 R_z(q_4) F_5)^T R_A^T R = R_z(q_5) R_y(\pm q_6) R_z(q_7):$$
   $q_5 = \mathrm{atan2}(M_{23}, M_{13})$, $q_7 = \mathrm{atan2}(M_{32}, -M_{31})$ and
   $q_6 = \pm \mathrm{atan2}(\sqrt{M_{13}^2 + M_{23}^2}, M_{33})$; $(q_5 + \pi, -q_6, q_7 + \pi)$ is the same rotation.

Each of joints 4, 3 and 6 has two solutions: eight postures for every pair of $h$ and $q_1$. A posture that does not
exist is NaN. All pairs are solved at once, as array operations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from uncom_tiago_exec.exceptions import RobotModelError
from uncom_tiago_exec.kinematics.options import ANALYTIC_IK, AnalyticIkOptions
from uncom_tiago_exec.types import FloatArray

# signs of the two arccosines for the first four postures; the other four have the second solution of the wrist
_JOINT_4_SIGNS = np.array([[1.0], [1.0], [-1.0], [-1.0]])
_JOINT_3_SIGNS = np.array([[1.0], [-1.0], [1.0], [-1.0]])
# a rotation about z is linear in (cos, sin, 1): their coefficients
_ROTATION_Z_TERMS = np.array(
    [np.diag([1.0, 1.0, 0.0]), [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], np.diag([0.0, 0.0, 1.0])]
)


class AnalyticIk:
    """Closed-form solver with the constants of one arm."""

    def __init__(self, model: Any, tool: int, *, options: AnalyticIkOptions = ANALYTIC_IK) -> None:
        """Read the placements of the joints and of the tool frame.

        Args:
            model: pinocchio model of torso and seven arm joints, in this order.
            tool: index of the frame that poses are given for.
            options: numbers that tune it.

        Raises:
            RobotModelError: the axes do not meet as those of a TIAGo arm do; a numerical solver can be used.
        """
        self._options = options
        placements = [np.array(model.jointPlacements[i].homogeneous) for i in range(1, 9)]
        kinds = [str(model.joints[i].shortname()) for i in range(1, 9)]
        if kinds != ["JointModelPZ"] + ["JointModelRZ"] * 7:
            raise RobotModelError("the joints are not one lift and seven turns about their own z axes")
        if not np.allclose(placements[0][:3, :3], np.eye(3), atol=options.axis_tolerance):
            raise RobotModelError("the torso does not rise along the vertical")
        self._torso_origin, self._placement_1, self._placement_2 = placements[0][:3, 3], placements[1], placements[2]
        self._placement_4 = placements[4]
        self._read_shoulder(placements[3])
        self._read_wrist(placements[5], placements[6], placements[7])
        frame = np.array(model.frames[tool].placement.homogeneous)
        self._tool_rotation, self._tool_offset = frame[:3, :3], frame[:3, 3]
        self._lower = np.array(model.lowerPositionLimit[2:8])[:, None, None]
        self._prepare()

    def _read_shoulder(self, placement_3: FloatArray) -> None:
        """Find S, where the axes of joints 2 and 3 meet, in the frames of both; placement (4, 4) of joint 3."""
        axis = placement_3[:3, 2]
        if abs(axis[2]) > self._options.axis_tolerance:
            raise RobotModelError("the axes of joints 2 and 3 are not at right angles")
        distance = float(placement_3[:2, 3] @ axis[:2])
        self._shoulder_z = float(placement_3[2, 3])
        gap = placement_3[:3, 3] - distance * axis - [0.0, 0.0, self._shoulder_z]
        if np.abs(gap).max() > self._options.meeting_tolerance_m:
            raise RobotModelError("the axes of joints 2 and 3 do not meet")
        self._rotation_3, self._shoulder_in_3 = placement_3[:3, :3], np.array([0.0, 0.0, -distance])

    def _read_wrist(self, placement_5: FloatArray, placement_6: FloatArray, placement_7: FloatArray) -> None:
        """Find W, where the axes of joints 5, 6 and 7 meet, in the frame of link 4; placements (4, 4)."""
        if (
            np.abs(placement_6[:2, 3]).max() > self._options.meeting_tolerance_m
            or np.abs(placement_7[:3, 3]).max() > self._options.meeting_tolerance_m
        ):
            raise RobotModelError("the axes of joints 5, 6 and 7 do not meet")
        self._wrist_in_4 = placement_5[:3, 3] + placement_5[:3, 2] * placement_6[2, 3]
        self._rotation_5 = placement_5[:3, :3]
        # F_6 R_z(q6) F_7 is a rotation about y by +-q6 if joint 6 turns about +-y and F_6 F_7 is the identity
        axis = placement_6[:3, 2]
        if (
            np.abs(placement_6[:3, :3] @ placement_7[:3, :3] - np.eye(3)).max() > self._options.axis_tolerance
            or abs(abs(axis[1]) - 1.0) > self._options.axis_tolerance
        ):
            raise RobotModelError("the wrist is not a ZYZ wrist")
        self._joint_6_sign = float(np.sign(axis[1]))

    def _prepare(self) -> None:
        """Compute all that does not depend on the pose, so that few array operations remain."""
        rotation, base = self._placement_4[:3, :3], self._placement_4[:3, 3] - self._shoulder_in_3
        w = self._wrist_in_4
        # u(q4) = base + rotation (R_z(q4) w): coefficients of cos q4, sin q4 and 1 as columns
        self._u_terms = np.column_stack(
            [rotation @ [w[0], w[1], 0.0], rotation @ [-w[1], w[0], 0.0], base + rotation @ [0.0, 0.0, w[2]]]
        )
        by_cos, by_sin, constant = self._u_terms.T
        # |u|^2 = mean + amplitude * cos(q4 - phase)
        self._mean = float(constant @ constant + by_cos @ by_cos)
        cosine, sine = 2.0 * float(constant @ by_cos), 2.0 * float(constant @ by_sin)
        self._phase, self._amplitude = float(np.arctan2(sine, cosine)), float(np.hypot(sine, cosine))
        third_row = complex(*self._rotation_3[2, :2])
        self._row_length, self._row_angle = abs(third_row), float(np.angle(third_row))
        # rotation and origin of frame A: coefficients of cos q1, sin q1 and 1 as rows
        a, b = self._placement_1[:3, :3], self._placement_2
        rotation_by_cos = a[:, :2] @ b[:2, :3]
        rotation_by_sin = np.outer(a[:, 1], b[0, :3]) - np.outer(a[:, 0], b[1, :3])
        self._rotation_terms = np.stack([rotation_by_cos, rotation_by_sin, np.outer(a[:, 2], b[2, :3])]).reshape(3, 9)
        x, y, z = b[:3, 3]
        base = self._torso_origin + self._placement_1[:3, 3] + a[:, 2] * z
        self._origin_terms = np.stack([a[:, 0] * x + a[:, 1] * y, a[:, 1] * x - a[:, 0] * y, base])
        # R_z(q2) F_3 R_z(q3) F_4 R_z(q4) F_5 is linear in the 27 products of (cos, sin, 1) of the three joints
        chain = [_ROTATION_Z_TERMS @ fixed for fixed in (self._rotation_3, self._placement_4[:3, :3], self._rotation_5)]
        products = chain[0][:, None, None] @ chain[1][None, :, None] @ chain[2][None, None]
        self._forearm_terms = np.ascontiguousarray(products.reshape(27, 9).T)

    def postures(self, targets: FloatArray, torso: FloatArray, first: FloatArray) -> FloatArray:
        """Return all postures that reach poses, for given torso heights and first joints.

        Args:
            targets: poses of the tool frame in the base (K, 4, 4), or one for all (4, 4).
            torso: torso heights (K,) [m].
            first: angles of the first arm joint (K,) [rad].

        Returns:
            Joint values (8, 8, K) [m, rad]: joint, posture, pair of parameters; NaN where there is no solution.
            Limits are not regarded, but each angle lies within a full turn above the lower limit of its joint.
        """
        link_7 = targets[..., :3, :3] @ self._tool_rotation.T
        wrist = targets[..., :3, 3] - link_7 @ self._tool_offset
        terms = np.empty((len(first), 3))
        terms[:, 0], terms[:, 1], terms[:, 2] = np.cos(first), np.sin(first), 1.0
        rotation = (terms @ self._rotation_terms).reshape(-1, 3, 3)  # of frame A
        v = wrist - terms @ self._origin_terms
        v[:, 2] -= torso
        v = (v[:, None] @ rotation)[:, 0].T  # (3, K), in frame A
        v[2] -= self._shoulder_z
        remaining = rotation.transpose(0, 2, 1) @ link_7
        q = np.empty((8, 8, len(first)))
        q[0], q[1] = torso, first
        with np.errstate(invalid="ignore"):
            self._solve(q, v, remaining.transpose(1, 2, 0)[:, :, None])
        q[:, 4:] = q[:, :4]  # the second solution of the wrist
        q[6, 4:] *= -1.0
        q[5:8:2, 4:] += np.pi
        angles = q[2:]
        angles -= 2.0 * np.pi * np.floor((angles - self._lower) / (2.0 * np.pi))
        return q

    def _solve(self, q: FloatArray, v: FloatArray, remaining: FloatArray) -> None:
        """Fill in joints 2 to 7 of the first four postures in q (8, 8, K), steps 2 to 5 of the module's derivation.

        Args:
            q: joint values to fill in.
            v: W - S in frame A (3, K).
            remaining: rotation of link 7 in frame A (3, 3, 1, K).
        """
        terms = np.ones((3, 3, 4, v.shape[1]))  # cos, sin and 1 of joints 2, 3 and 4
        two, three, four = terms
        squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        q4 = np.add(self._phase, _JOINT_4_SIGNS * np.arccos((squared - self._mean) / self._amplitude), out=q[4, :4])
        np.cos(q4, out=four[0])
        np.sin(q4, out=four[1])
        u = (self._u_terms @ four.reshape(3, -1)).reshape(four.shape)
        rho = np.hypot(u[0], u[1])
        cosine = (v[2] - self._rotation_3[2, 2] * u[2]) / (self._row_length * rho)
        angle = self._row_angle + _JOINT_3_SIGNS * np.arccos(cosine)  # of R_z(q3) u about the axis of joint 3
        q3 = np.subtract(angle, np.arctan2(u[1], u[0]), out=q[3, :4])
        np.cos(q3, out=three[0])
        np.sin(q3, out=three[1])
        u[0] = rho * np.cos(angle)
        u[1] = rho * np.sin(angle)
        p = (self._rotation_3[:2] @ u.reshape(3, -1)).reshape(2, *rho.shape)
        q2 = np.subtract(np.arctan2(v[1], v[0]), np.arctan2(p[1], p[0]), out=q[2, :4])
        np.cos(q2, out=two[0])
        np.sin(q2, out=two[1])
        products = (two[:, None] * three)[:, :, None] * four
        forearm = (self._forearm_terms @ products.reshape(27, -1)).reshape(3, 3, *rho.shape)
        column = (forearm * remaining[:, 2][:, None]).sum(axis=0)  # third column of M = forearm^T remaining
        row = (forearm[:, 2][:, None] * remaining[:, :2]).sum(axis=0)  # its third row
        sine = np.hypot(column[0], column[1])
        np.arctan2(column[1], column[0], out=q[5, :4])
        np.multiply(self._joint_6_sign, np.arctan2(sine, column[2]), out=q[6, :4])
        np.arctan2(row[1], -row[0], out=q[7, :4])
        singular = sine < self._options.singular_sine  # joints 5 and 7 turn about one axis: joint 5 is set to zero
        if singular.any():
            first_column = (forearm * remaining[:, 0][:, None]).sum(axis=0)
            q[5, :4][singular] = 0.0
            q[7, :4][singular] = np.arctan2(first_column[1], first_column[0])[singular]
