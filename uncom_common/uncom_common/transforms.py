# SPDX-License-Identifier: Apache-2.0
"""A tree of frames over time (REP 105), without ROS.

tf2 has no wheel for the pip way of installing, so this is the small part of it that the nodes need.
Naming: `transform_a_to_b` is the (4, 4) matrix that maps coordinates in frame a to coordinates in frame b.
"""

from __future__ import annotations

import threading
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, Slerp

from uncom_common.exceptions import TransformError
from uncom_common.options import TRANSFORM_BUFFER, TransformBufferOptions

FloatArray = npt.NDArray[np.float64]


def matrix_from_pose(position: npt.ArrayLike, quaternion_xyzw: npt.ArrayLike) -> FloatArray:
    """Build a (4, 4) transform from a position (3,) [m] and a quaternion (4,) in x y z w order."""
    positions, quaternions = (np.asarray(part, dtype=float)[None] for part in (position, quaternion_xyzw))
    return np.asarray(matrices_from_poses(positions, quaternions)[0])


def matrices_from_poses(positions: FloatArray, quaternions_xyzw: FloatArray) -> FloatArray:
    """Build transforms (N, 4, 4) from positions (N, 3) [m] and quaternions (N, 4) in x y z w order."""
    matrices = np.tile(np.eye(4), (len(positions), 1, 1))
    matrices[:, :3, :3] = Rotation.from_quat(quaternions_xyzw).as_matrix()
    matrices[:, :3, 3] = positions
    return matrices


def pose_from_matrix(matrix: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Split a (4, 4) transform into position (3,) [m] and quaternion (4,) in x y z w order."""
    m = np.asarray(matrix, dtype=float)
    return m[:3, 3].copy(), Rotation.from_matrix(m[:3, :3]).as_quat()


def invert(matrix: npt.ArrayLike) -> FloatArray:
    """Invert a rigid (4, 4) transform."""
    m = np.asarray(matrix, dtype=float)
    inverse = np.eye(4)
    inverse[:3, :3] = m[:3, :3].T
    inverse[:3, 3] = -m[:3, :3].T @ m[:3, 3]
    return inverse


def apply(matrix: npt.ArrayLike, points: npt.ArrayLike) -> FloatArray:
    """Map points (..., 3) by a (4, 4) transform."""
    m = np.asarray(matrix, dtype=float)
    return np.asarray(np.asarray(points, dtype=float) @ m[:3, :3].T + m[:3, 3])


@dataclass(frozen=True, slots=True)
class StampedTransform:
    """Pose of a child frame in its parent at a time [s]."""

    stamp_s: float
    parent: str
    child: str
    matrix: FloatArray


class TransformBuffer:
    """Keeps the latest transforms of every frame and answers between any two of them. Thread safe."""

    def __init__(
        self, keep_s: float = TRANSFORM_BUFFER.keep_s, options: TransformBufferOptions = TRANSFORM_BUFFER
    ) -> None:
        """Begin empty.

        Args:
            keep_s: how long transforms of moving frames are kept [s].
            options: how far in time transforms hold.
        """
        self._keep_s = keep_s
        self._options = options
        self._moving: dict[str, deque[StampedTransform]] = {}
        self._fixed: dict[str, StampedTransform] = {}
        self._lock = threading.Lock()

    def add(self, transform: StampedTransform, *, static: bool = False) -> None:
        """Take in one transform; static ones hold for all times."""
        with self._lock:
            if static:
                self._fixed[transform.child] = transform
                return
            history = self._moving.setdefault(transform.child, deque())
            if history and transform.stamp_s < history[-1].stamp_s - self._options.restart_jump_s:
                history.clear()  # time jumped back: a bag was started again
            if history and transform.stamp_s <= history[-1].stamp_s:
                return
            history.append(transform)
            while history[-1].stamp_s - history[0].stamp_s > self._keep_s:
                history.popleft()

    def frames(self) -> frozenset[str]:
        """Return the names of all known frames."""
        with self._lock:
            links = [*self._fixed.values(), *(h[-1] for h in self._moving.values())]
        return frozenset(name for link in links for name in (link.parent, link.child))

    def lookup(self, source_frame: str, target_frame: str, stamp_s: float | None = None) -> FloatArray:
        """Return transform_source_to_target (4, 4) at a time [s], or the latest for None.

        Raises:
            TransformError: frames unknown or not connected, or a time too far (max_extrapolation_s) from the known.
        """
        with self._lock:
            source, source_root = self._to_root(source_frame, stamp_s, target_frame)
            target, target_root = self._to_root(target_frame, stamp_s, source_frame)
        if source_root != target_root:
            raise TransformError(target_frame, source_frame, "the frames are not connected", self.frames())
        return invert(target) @ source

    def _to_root(self, frame: str, stamp_s: float | None, other: str) -> tuple[FloatArray, str]:
        matrix = np.eye(4)
        for _ in range(self._options.max_chain):
            link = self._fixed.get(frame)
            if link is not None:
                matrix = link.matrix @ matrix
            elif frame in self._moving:
                link = self._moving[frame][-1]
                matrix = _interpolate(self._moving[frame], stamp_s, other, self._options) @ matrix
            else:
                return matrix, frame
            frame = link.parent
        raise TransformError(other, frame, "the frames form a loop")


def _interpolate(
    history: deque[StampedTransform], stamp_s: float | None, other: str, options: TransformBufferOptions
) -> FloatArray:
    """Return a frame's pose (4, 4) in its parent at a time [s]; the latest for None.

    Raises:
        TransformError: the time is too far before the first or after the last pose; it names the frame `other`.
    """
    if stamp_s is None or len(history) == 1 or stamp_s >= history[-1].stamp_s:
        last = history[-1]
        if stamp_s is not None and stamp_s - last.stamp_s > options.max_extrapolation_s:
            raise TransformError(other, last.child, f"asked for {stamp_s:.3f} s, the latest is {last.stamp_s:.3f} s")
        return last.matrix
    if stamp_s <= history[0].stamp_s:
        if history[0].stamp_s - stamp_s > options.max_extrapolation_s:
            first = history[0]
            raise TransformError(other, first.child, f"asked for {stamp_s:.3f} s, the first is {first.stamp_s:.3f} s")
        return history[0].matrix
    after = bisect_left(history, stamp_s, key=attrgetter("stamp_s"))
    a, b = history[after - 1], history[after]
    if np.array_equal(a.matrix, b.matrix):  # most joints rest
        return a.matrix
    weight = (stamp_s - a.stamp_s) / (b.stamp_s - a.stamp_s)
    matrix = np.eye(4)
    matrix[:3, 3] = (1.0 - weight) * a.matrix[:3, 3] + weight * b.matrix[:3, 3]
    rotations = Rotation.from_matrix(np.stack([a.matrix[:3, :3], b.matrix[:3, :3]]))
    matrix[:3, :3] = Slerp([0.0, 1.0], rotations)(weight).as_matrix()
    return matrix
