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

from uncom_tiago_exec.types import FloatArray

_EXACT = 1e-7  # [m, or of a unit vector] how well the axes have to meet
_SIGN_4 = np.array([[1.0], [1.0], [-1.0], [-1.0]])  # of the first four postures; the others turn the wrist over
_SIGN_3 = np.array([[1.0], [-1.0], [1.0], [-1.0]])


class ClosedForm:
    """Constants of one arm, read from its model (torso and seven joints, in this order)."""

    def __init__(self, model: Any, tool: int) -> None:
        """Read the placements of the joints and of the tool frame.

        Raises:
            ValueError: the axes do not meet as those of a TIAGo's arm do; use a numerical solver.
        """
        at = [np.array(model.jointPlacements[i].homogeneous) for i in range(1, 9)]
        kinds = [str(model.joints[i].shortname()) for i in range(1, 9)]
        if kinds != ["JointModelPZ"] + ["JointModelRZ"] * 7:
            raise ValueError("the joints are not one lift and seven turns about their own z axes")
        if not np.allclose(at[0][:3, :3], np.eye(3), atol=_EXACT):
            raise ValueError("the torso does not rise along the vertical")
        frame = np.array(model.frames[tool].placement.homogeneous)
        self._torso, self._first, self._second = at[0][:3, 3], at[1], at[2]
        # S: where the axis of joint 3 meets that of joint 2, in the frames of both
        third = at[3]
        along = third[:3, 2]
        if abs(along[2]) > _EXACT:
            raise ValueError("the axes of joints 2 and 3 are not at right angles")
        reach = float(third[:2, 3] @ along[:2])
        self._shoulder_z = float(third[2, 3])
        if np.abs(third[:3, 3] - reach * along - [0.0, 0.0, self._shoulder_z]).max() > 1e-6:
            raise ValueError("the axes of joints 2 and 3 do not meet")
        self._third, self._shoulder_in_third = third[:3, :3], np.array([0.0, 0.0, -reach])
        self._fourth = at[4]
        # W in the frame of joint 4: on the axis of joint 5, where joints 6 and 7 turn
        if np.abs(at[6][:2, 3]).max() > 1e-6 or np.abs(at[7][:3, 3]).max() > 1e-6:
            raise ValueError("the axes of joints 5, 6 and 7 do not meet")
        self._wrist = at[5][:3, 3] + at[5][:3, 2] * at[6][2, 3]
        six = at[6][:3, :3]
        self._fifth = at[5][:3, :3]
        # R56 Rz(q6) R67 = turn about y by sign * q6, then a fixed rest that must be none
        axis = six[:, 2]
        if np.abs(six @ at[7][:3, :3] - np.eye(3)).max() > _EXACT or abs(abs(axis[1]) - 1.0) > _EXACT:
            raise ValueError("the wrist is not a ZYZ wrist")
        self._sign = float(np.sign(axis[1]))
        self._tool_turn, self._tool_offset = frame[:3, :3], frame[:3, 3]
        self._prepare()

    def _prepare(self) -> None:
        """Work out the constants of |W - S| as a function of joint 4: ground + cos * q4 terms + sin * q4 terms."""
        turn, base = self._fourth[:3, :3], self._fourth[:3, 3] - self._shoulder_in_third
        w = self._wrist
        # W3 - S3 = base + turn (Rz(q4) w) = constant + c * even + s * odd
        self._constant = base + turn @ np.array([0.0, 0.0, w[2]])
        self._even = turn @ np.array([w[0], w[1], 0.0])
        self._odd = turn @ np.array([-w[1], w[0], 0.0])
        self._ground = float(self._constant @ self._constant + self._even @ self._even)
        cosine = 2.0 * float(self._constant @ self._even)
        sine = 2.0 * float(self._constant @ self._odd)
        self._phase, self._amplitude = float(np.arctan2(sine, cosine)), float(np.hypot(sine, cosine))
        self._moving = (self._even - 1j * self._odd)[:, None, None]
        self._across = complex(*self._third[2, :2])
        self._plane = self._third[0] + 1j * self._third[1]
        a, b = self._first[:3, :3], self._second
        by_cosine = a[:, :2] @ b[:2, :3]
        by_sine = np.outer(a[:, 1], b[0, :3]) - np.outer(a[:, 0], b[1, :3])
        self._rotations = np.stack([by_cosine, by_sine, np.outer(a[:, 2], b[2, :3])]).reshape(3, 9)
        x, y, z = b[:3, 3]
        base = self._torso + self._first[:3, 3] + a[:, 2] * z
        self._origins = np.stack([a[:, 0] * x + a[:, 1] * y, a[:, 1] * x - a[:, 0] * y, base])

    def postures(self, targets: FloatArray, torso: FloatArray, first: FloatArray) -> FloatArray:
        """Return joint vectors (8, K, 8) for hand poses (K, 4, 4) or (4, 4), torso [m] (K,), first joints [rad] (K,).

        The first index is the posture; NaN where there is none. Limits are not regarded; angles are in (-pi, pi].
        """
        turn = targets[..., :3, :3] @ self._tool_turn.T  # of joint 7 in the base
        wrist = targets[..., :3, 3] - turn @ self._tool_offset
        at_first = np.empty((len(first), 3))
        at_first[:, 0], at_first[:, 1], at_first[:, 2] = np.cos(first), np.sin(first), 1.0
        # rotation of the frame before joint 2 turns, and its origin: linear in cos and sin of joint 1
        rotation = (at_first @ self._rotations).reshape(-1, 3, 3)
        away = wrist - at_first @ self._origins
        away[:, 2] -= torso
        away = np.einsum("kj,kji->ik", away, rotation)  # (3, K) in the frame before joint 2
        away[2] -= self._shoulder_z
        rest = np.einsum("kji,jl->ilk" if turn.ndim == 2 else "kji,kjl->ilk", rotation, turn)
        return self._solve(rest, away, torso, first)

    def _solve(self, rest: FloatArray, away: FloatArray, torso: FloatArray, first: FloatArray) -> FloatArray:
        """Go on from W - S (3, K) and the rotation that remains (3, 3, K), both in the frame before joint 2."""
        q = np.empty((8, len(torso), 8))
        half = q[:4]
        # pairs of components are complex numbers here: turning about z is a product with exp(i angle)
        with np.errstate(invalid="ignore"):
            turn4 = np.arccos((np.einsum("ij,ij->j", away, away) - self._ground) / self._amplitude)
            q4 = self._phase + _SIGN_4 * turn4
            e4 = np.exp(1j * q4)
            u = self._constant[:, None, None] + (self._moving * e4).real  # W - S, frame 3
            flat = u[0] + 1j * u[1]
            # the component along the axis of joint 2 does not depend on joint 2
            beside = self._across * flat.conj()
            height = (away[2] - self._third[2, 2] * u[2]) / np.abs(beside)
            q3 = np.arctan2(beside.imag, beside.real) + _SIGN_3 * np.arccos(height)
            e3 = np.exp(1j * q3)
            turned = e3 * flat
            plane = self._plane[0] * turned.real + self._plane[1] * turned.imag + self._plane[2] * u[2]
            e2 = (away[0] + 1j * away[1]) * plane.conj()
            q2 = np.arctan2(e2.imag, e2.real)
            rest = _unturned(rest[:, :, None], e2 / np.abs(e2), self._third)
            rest = _unturned(rest, e3, self._fourth[:3, :3])
            rest = _unturned(rest, e4, self._fifth)
            sine = np.hypot(rest[0, 2], rest[1, 2])
            q5, q7 = np.arctan2(rest[1, 2], rest[0, 2]), np.arctan2(rest[2, 1], -rest[2, 0])
            straight = sine < 1e-9  # joints 5 and 7 turn about one axis
            if straight.any():
                q5 = np.where(straight, 0.0, q5)
                q7 = np.where(straight, np.arctan2(rest[1, 0], rest[0, 0]), q7)
        half[..., 0], half[..., 1], half[..., 2], half[..., 3], half[..., 4] = torso, first, q2, q3, q4
        half[..., 5], half[..., 6], half[..., 7] = q5, self._sign * np.arctan2(sine, rest[2, 2]), q7
        q[4:] = half
        q[4:, :, 6] *= -1.0
        q[4:, :, 5] += np.pi
        q[4:, :, 7] += np.pi
        angles = q[..., 2:]
        angles -= 2.0 * np.pi * np.ceil((angles - np.pi) / (2.0 * np.pi))
        return q


def _unturned(rest: FloatArray, turn: Any, fixed: FloatArray) -> FloatArray:
    """Return fixed^T Rz(-angle) rest for rotations (3, 3, ..) along the first axes; turn is exp(i angle)."""
    flat = (rest[0] + 1j * rest[1]) * turn.conj()
    mixed = np.empty((3, *flat.shape))
    mixed[0], mixed[1], mixed[2] = flat.real, flat.imag, rest[2]
    return np.asarray((fixed.T @ mixed.reshape(3, -1)).reshape(mixed.shape))
