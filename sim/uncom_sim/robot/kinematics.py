# SPDX-License-Identifier: Apache-2.0
"""Joints of a URDF and its forward kinematics, as far as a robot_state_publisher needs them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation
from uncom_common.transforms import FloatArray

from uncom_sim.exceptions import SimError

MOVING = ("revolute", "continuous", "prismatic")


def origin_matrix(element: ET.Element) -> FloatArray:
    """Return the `<origin>` of a URDF element as a (4, 4) transform; none means identity."""
    matrix = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        matrix[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy", "0 0 0"))).as_matrix()
        matrix[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
    return matrix


def set_origin(element: ET.Element, matrix: FloatArray) -> None:
    """Write a (4, 4) transform as the `<origin>` of a URDF element."""
    origin = element.find("origin")
    if origin is None:
        origin = ET.SubElement(element, "origin")
    origin.set("xyz", " ".join(f"{v:.10g}" for v in matrix[:3, 3]))
    origin.set(
        "rpy",
        " ".join(f"{v:.10g}" for v in Rotation.from_matrix(matrix[:3, :3]).as_euler("xyz", suppress_warnings=True)),
    )


def _numbers(text: str) -> FloatArray:
    return np.array([float(word) for word in text.split()])


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint of the robot; limits in rad or m, rad/s or m/s, N m or N."""

    name: str
    kind: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float

    @property
    def moves(self) -> bool:
        """Whether the joint is not fixed."""
        return self.kind in MOVING

    def transform(self, position: float) -> FloatArray:
        """Return transform_child_to_parent (4, 4) at a joint position [rad or m]."""
        motion = np.eye(4)
        if self.kind == "prismatic":
            motion[:3, 3] = position * self.axis
        elif self.moves:
            motion[:3, :3] = Rotation.from_rotvec(position * self.axis).as_matrix()
        return np.asarray(self.origin @ motion)


def joint_from_element(element: ET.Element) -> Joint:
    """Read one `<joint>`."""
    limit, axis = element.find("limit"), element.find("axis")

    def number(key: str, default: str) -> float:
        return float(default if limit is None else limit.get(key, default))

    return Joint(
        name=element.get("name", ""),
        kind=element.get("type", "fixed"),
        parent=element.find("parent").get("link", ""),  # type: ignore[union-attr]
        child=element.find("child").get("link", ""),  # type: ignore[union-attr]
        origin=origin_matrix(element),
        axis=_numbers(axis.get("xyz", "1 0 0")) if axis is not None else np.array([1.0, 0.0, 0.0]),
        lower=number("lower", "-inf"),
        upper=number("upper", "inf"),
        velocity=number("velocity", "inf"),
        effort=number("effort", "inf"),
    )


class FrameTree:
    """The transforms of many joints at once, as position and quaternion: cheap enough for every message."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        """Stack origins and axes of joints (N); positions are given later in the same order."""
        self.parents = tuple(joint.parent for joint in joints)
        self.children = tuple(joint.child for joint in joints)
        origins = np.array([joint.origin for joint in joints])
        self._turns = Rotation.from_matrix(origins[:, :3, :3]).as_quat()
        self._places = origins[:, :3, 3]
        self._axes = np.array([joint.axis for joint in joints])
        self._slides = np.array([joint.kind == "prismatic" for joint in joints])
        self._ahead = np.einsum("nij,nj->ni", origins[:, :3, :3], self._axes)

    def poses(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places (N, 3) [m] and quaternions (N, 4; x y z w) for joint positions (N,) [rad or m]."""
        places = self._places + np.where(self._slides, positions, 0.0)[:, None] * self._ahead
        half = np.where(self._slides, 0.0, positions)[:, None] / 2.0
        xyz, w = self._axes * np.sin(half), np.cos(half)
        v, s = self._turns[:, :3], self._turns[:, 3:]
        vector = s * xyz + w * v + np.cross(v, xyz)
        scalar = s * w - np.sum(v * xyz, axis=1, keepdims=True)
        return places, np.concatenate([vector, scalar], axis=1)


class Kinematics:
    """All joints of a robot by name, and the places of its frames."""

    def __init__(self, urdf: str) -> None:
        """Read the joints of a robot from the text of its URDF."""
        robot = ET.fromstring(urdf)  # noqa: S314  (our own text)
        self.joints = {j.name: j for j in map(joint_from_element, robot.findall("joint"))}
        self._above = {joint.child: joint for joint in self.joints.values()}

    def pose(self, frame: str, positions: Mapping[str, float], root: str = "base_footprint") -> FloatArray:
        """Return transform_frame_to_root (4, 4); joints not named in `positions` are at 0.

        Raises:
            SimError: the frame does not hang on the root.
        """
        matrix = np.eye(4)
        link = frame
        while link != root:
            joint = self._above.get(link)
            if joint is None:
                raise SimError(f"frame {frame} does not hang on {root} in the robot's URDF")
            matrix = joint.transform(positions.get(joint.name, 0.0)) @ matrix
            link = joint.parent
        return matrix
