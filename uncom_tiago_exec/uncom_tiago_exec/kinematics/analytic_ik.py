# SPDX-License-Identifier: Apache-2.0
"""Closed-form inverse kinematics of a TIAGo arm: all postures for given torso heights and first joints, at once.

The axes of joints 2 and 3 meet in a shoulder S, those of 5, 6 and 7 in a wrist W. For a hand pose W is known, and for
a torso height and a first joint so is S. Their distance gives joint 4, the height of W over the plane of joint 2 gives
joint 3, its direction in that plane joint 2; what rotation remains is a ZYZ turn of the wrist (Paul 1981, chapter 3).
Each of joints 4, 3 and 6 has two answers: eight postures for every pair of torso height and first joint.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from uncom_tiago_exec.kinematics.options import ANALYTIC_IK, AnalyticIkOptions
from uncom_tiago_exec.types import FloatArray

_SIGN_4 = np.array([[1.0], [1.0], [-1.0], [-1.0]])  # of the first four postures; the others turn the wrist over
_SIGN_3 = np.array([[1.0], [-1.0], [1.0], [-1.0]])
# a turn about z is cos * _TURN[0] + sin * _TURN[1] + _TURN[2]
_TURN = np.array(
    [np.diag([1.0, 1.0, 0.0]), [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], np.diag([0.0, 0.0, 1.0])]
)


class AnalyticIk:
    """Constants of one arm, read from its model (torso and seven joints, in this order)."""

    def __init__(self, model: Any, tool: int, *, options: AnalyticIkOptions = ANALYTIC_IK) -> None:
        """Read the placements of the joints and of the tool frame.

        Raises:
            ValueError: the axes do not meet as those of a TIAGo's arm do; use a numerical solver.
        """
        self._options = options
        at = [np.array(model.jointPlacements[i].homogeneous) for i in range(1, 9)]
        kinds = [str(model.joints[i].shortname()) for i in range(1, 9)]
        if kinds != ["JointModelPZ"] + ["JointModelRZ"] * 7:
            raise ValueError("the joints are not one lift and seven turns about their own z axes")
        if not np.allclose(at[0][:3, :3], np.eye(3), atol=self._options.axis_tolerance):
            raise ValueError("the torso does not rise along the vertical")
        frame = np.array(model.frames[tool].placement.homogeneous)
        self._torso, self._first, self._second = at[0][:3, 3], at[1], at[2]
        # S: where the axis of joint 3 meets that of joint 2, in the frames of both
        third = at[3]
        along = third[:3, 2]
        if abs(along[2]) > self._options.axis_tolerance:
            raise ValueError("the axes of joints 2 and 3 are not at right angles")
        reach = float(third[:2, 3] @ along[:2])
        self._shoulder_z = float(third[2, 3])
        if (
            np.abs(third[:3, 3] - reach * along - [0.0, 0.0, self._shoulder_z]).max()
            > self._options.meeting_tolerance_m
        ):
            raise ValueError("the axes of joints 2 and 3 do not meet")
        self._third, self._shoulder_in_third = third[:3, :3], np.array([0.0, 0.0, -reach])
        self._fourth = at[4]
        # W in the frame of joint 4: on the axis of joint 5, where joints 6 and 7 turn
        if (
            np.abs(at[6][:2, 3]).max() > self._options.meeting_tolerance_m
            or np.abs(at[7][:3, 3]).max() > self._options.meeting_tolerance_m
        ):
            raise ValueError("the axes of joints 5, 6 and 7 do not meet")
        self._wrist = at[5][:3, 3] + at[5][:3, 2] * at[6][2, 3]
        six = at[6][:3, :3]
        self._fifth = at[5][:3, :3]
        # R56 Rz(q6) R67 = turn about y by sign * q6, then a fixed rest that must be none
        axis = six[:, 2]
        if (
            np.abs(six @ at[7][:3, :3] - np.eye(3)).max() > self._options.axis_tolerance
            or abs(abs(axis[1]) - 1.0) > self._options.axis_tolerance
        ):
            raise ValueError("the wrist is not a ZYZ wrist")
        self._sign = float(np.sign(axis[1]))
        self._tool_turn, self._tool_offset = frame[:3, :3], frame[:3, 3]
        self._lower = np.array(model.lowerPositionLimit[2:8])[:, None, None]
        self._prepare()

    def _prepare(self) -> None:
        """Work out what does not depend on the pose, so that few operations on arrays remain."""
        turn, base = self._fourth[:3, :3], self._fourth[:3, 3] - self._shoulder_in_third
        w = self._wrist
        # W3 - S3 = base + turn (Rz(q4) w), linear in cos and sin of joint 4
        self._reach = np.column_stack(
            [turn @ [w[0], w[1], 0.0], turn @ [-w[1], w[0], 0.0], base + turn @ [0.0, 0.0, w[2]]]
        )
        even, odd, constant = self._reach.T
        # |W - S| as a function of joint 4: ground + amplitude * cos(q4 - phase)
        self._ground = float(constant @ constant + even @ even)
        cosine, sine = 2.0 * float(constant @ even), 2.0 * float(constant @ odd)
        self._phase, self._amplitude = float(np.arctan2(sine, cosine)), float(np.hypot(sine, cosine))
        across = complex(*self._third[2, :2])
        self._across, self._across_angle = abs(across), float(np.angle(across))
        a, b = self._first[:3, :3], self._second
        by_cosine = a[:, :2] @ b[:2, :3]
        by_sine = np.outer(a[:, 1], b[0, :3]) - np.outer(a[:, 0], b[1, :3])
        self._rotations = np.stack([by_cosine, by_sine, np.outer(a[:, 2], b[2, :3])]).reshape(3, 9)
        x, y, z = b[:3, 3]
        base = self._torso + self._first[:3, 3] + a[:, 2] * z
        self._origins = np.stack([a[:, 0] * x + a[:, 1] * y, a[:, 1] * x - a[:, 0] * y, base])
        # the turn from joint 2 to the wrist, Rz(q2) F3 Rz(q3) F4 Rz(q4) F5, is linear in the products of (cos, sin, 1)
        chain = [_TURN @ fixed for fixed in (self._third, self._fourth[:3, :3], self._fifth)]
        products = chain[0][:, None, None] @ chain[1][None, :, None] @ chain[2][None, None]
        self._products = np.ascontiguousarray(products.reshape(27, 9).T)

    def postures(self, targets: FloatArray, torso: FloatArray, first: FloatArray) -> FloatArray:
        """Return joint values (8, 8, K) for hand poses (K, 4, 4) or (4, 4), torso [m] (K,), first joints [rad] (K,).

        The first index is the joint, the second the posture; NaN where there is none. Limits are not regarded, but
        each angle is the one within a turn above its joint's lower limit.
        """
        turn = targets[..., :3, :3] @ self._tool_turn.T  # of joint 7 in the base
        wrist = targets[..., :3, 3] - turn @ self._tool_offset
        at_first = np.empty((len(first), 3))
        at_first[:, 0], at_first[:, 1], at_first[:, 2] = np.cos(first), np.sin(first), 1.0
        # rotation of the frame before joint 2 turns, and its origin: linear in cos and sin of joint 1
        rotation = (at_first @ self._rotations).reshape(-1, 3, 3)
        away = wrist - at_first @ self._origins
        away[:, 2] -= torso
        away = (away[:, None] @ rotation)[:, 0].T  # (3, K) in the frame before joint 2
        away[2] -= self._shoulder_z
        rest = rotation.transpose(0, 2, 1) @ turn
        q = np.empty((8, 8, len(first)))
        q[0], q[1] = torso, first
        with np.errstate(invalid="ignore"):
            self._solve(q, away, rest.transpose(1, 2, 0)[:, :, None])
        q[:, 4:] = q[:, :4]  # the wrist turned over
        q[6, 4:] *= -1.0
        q[5:8:2, 4:] += np.pi
        angles = q[2:]
        angles -= 2.0 * np.pi * np.floor((angles - self._lower) / (2.0 * np.pi))
        return q

    def _solve(self, q: FloatArray, away: FloatArray, rest: FloatArray) -> None:
        """Fill in joints 2 to 7 of the first four postures.

        From W - S (3, K) and the rotation that remains (3, 3, 1, K), both in the frame before joint 2.
        """
        turns = np.ones((3, 3, 4, away.shape[1]))  # of joints 2, 3, 4: cosine, sine, 1
        two, three, four = turns
        far = away[0] * away[0] + away[1] * away[1] + away[2] * away[2]
        q4 = np.add(self._phase, _SIGN_4 * np.arccos((far - self._ground) / self._amplitude), out=q[4, :4])
        np.cos(q4, out=four[0])
        np.sin(q4, out=four[1])
        u = (self._reach @ four.reshape(3, -1)).reshape(four.shape)  # W - S, frame 3
        flat = np.hypot(u[0], u[1])
        # the component along the axis of joint 2 does not depend on joint 2
        height = (away[2] - self._third[2, 2] * u[2]) / (self._across * flat)
        around = self._across_angle + _SIGN_3 * np.arccos(height)
        q3 = np.subtract(around, np.arctan2(u[1], u[0]), out=q[3, :4])
        np.cos(q3, out=three[0])
        np.sin(q3, out=three[1])
        u[0] = flat * np.cos(around)
        u[1] = flat * np.sin(around)
        plane = (self._third[:2] @ u.reshape(3, -1)).reshape(2, *flat.shape)
        q2 = np.subtract(np.arctan2(away[1], away[0]), np.arctan2(plane[1], plane[0]), out=q[2, :4])
        np.cos(q2, out=two[0])
        np.sin(q2, out=two[1])
        products = (two[:, None] * three)[:, :, None] * four
        fore = (self._products @ products.reshape(27, -1)).reshape(3, 3, *flat.shape)
        last = (fore * rest[:, 2][:, None]).sum(axis=0)  # third column of the turn of the wrist: fore^T rest
        row = (fore[:, 2][:, None] * rest[:, :2]).sum(axis=0)  # its third row
        sine = np.hypot(last[0], last[1])
        np.arctan2(last[1], last[0], out=q[5, :4])
        np.multiply(self._sign, np.arctan2(sine, last[2]), out=q[6, :4])
        np.arctan2(row[1], -row[0], out=q[7, :4])
        straight = sine < self._options.singular_sine  # joints 5 and 7 turn about one axis
        if straight.any():
            column = (fore * rest[:, 0][:, None]).sum(axis=0)
            q[5, :4][straight] = 0.0
            q[7, :4][straight] = np.arctan2(column[1], column[0])[straight]
