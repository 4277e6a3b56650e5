# SPDX-License-Identifier: Apache-2.0
"""The robot for planning: kinematics and collision shapes from its URDF, one torso and arm group per side."""

from __future__ import annotations

import itertools
import logging
import os
import re
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from uncom_tiago_exec.exceptions import RobotModelError
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.clearance_maps import ClearanceMap, load_clearance_maps
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.robot.joint_names import TORSO_JOINT, arm_joints, finger_joints, group_joints
from uncom_tiago_exec.robot.link_pairs import adjacent_pairs, disabled_pairs, link_of_geometry
from uncom_tiago_exec.types import FloatArray, Side

_LOG = logging.getLogger(__name__)
_CAMERA_FRAMES = ("head_front_camera_rgb_optical_frame", "xtion_rgb_optical_frame", "head_2_link")
_IGNORED_LINKS = re.compile(r"caster|wheel|antenna|suspension|cover|sonar|mic")


def package_directories() -> list[str]:
    """Return the folders in which package:// URIs are resolved: ROS, ament index, and installed wheels."""
    found = [p for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    found += [str(Path(p) / "share") for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    found.append(str(Path(pin.__file__).parents[4] / "share"))
    found += [str(p) for p in Path(pin.__file__).parents[2].glob("cmeel.prefix/share")]
    known = [p for p in dict.fromkeys(found) if Path(p).is_dir()]
    return known + [str(robots) for p in known if (robots := Path(p) / "example-robot-data" / "robots").is_dir()]


class RobotModel:
    """The whole robot as its URDF describes it.

    Attributes:
        model: its pinocchio model; the base frame is base_footprint.
        geometry: its collision shapes, meshes replaced by their convex hulls.
    """

    def __init__(self, urdf: str, package_dirs: Iterable[str] | None = None) -> None:
        """Parse a URDF and load its collision meshes.

        Args:
            urdf: text of the description.
            package_dirs: folders in which package:// URIs are resolved; those of package_directories if None.

        Raises:
            RobotModelError: it is no URDF, a mesh is missing, or not all joints of a TIAGo++ are there.
        """
        directories = list(package_dirs) if package_dirs is not None else package_directories()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self.model: Any = pin.buildModelFromXML(urdf)
                self.geometry: Any = pin.buildGeomFromUrdfString(
                    self.model, urdf, pin.GeometryType.COLLISION, directories
                )
        except (ValueError, RuntimeError) as err:
            reason = str(err).splitlines()[0] if str(err) else "unknown"
            raise RobotModelError(f"/robot_description cannot be used for planning: {reason}") from err
        required = {TORSO_JOINT, *(j for s in ("left", "right") for j in (*arm_joints(s), *finger_joints(s)))}
        missing = sorted(required - set(self.model.names))
        if missing:
            raise RobotModelError(f"/robot_description lacks joints of a TIAGo++ with grippers: {', '.join(missing)}")
        self._reach: dict[Side, float] = {}
        self._pairs: dict[Side, tuple[tuple[int, int], ...]] = {}
        self._clearance_maps: dict[Side, dict[tuple[int, int], ClearanceMap]] = {}
        self._grippers: dict[Side, GripperShape] = {}
        for name in [g.name for g in self.geometry.geometryObjects if _ignored(g)]:
            self.geometry.removeGeometryObject(name)
        for geometry in self.geometry.geometryObjects:
            if isinstance(geometry.geometry, coal.BVHModelBase):
                geometry.geometry = _hull(geometry.geometry)

    def configuration(self, positions: Mapping[str, float]) -> FloatArray:
        """Return the configuration of the whole model with joints given by name [rad, or m]; others are neutral.

        Names that the model does not have, and joints of more than one coordinate, are passed over.
        """
        q = np.array(pin.neutral(self.model))
        for name, value in positions.items():
            if self.model.existJointName(name):
                joint = self.model.joints[self.model.getJointId(name)]
                if joint.nq == 1:
                    q[joint.idx_q] = value
        return q

    def camera(self, positions: Mapping[str, float]) -> FloatArray:
        """Return the position (3,) of the head camera in base_footprint [m], at joint positions by name.

        Raises:
            RobotModelError: the robot has no frame of such a camera.
        """
        frame = next((name for name in _CAMERA_FRAMES if self.model.existFrame(name)), None)
        if frame is None:
            raise RobotModelError(f"/robot_description has none of the frames {', '.join(_CAMERA_FRAMES)}")
        data = self.model.createData()
        pin.framesForwardKinematics(self.model, data, self.configuration(positions))
        return np.array(data.oMf[self.model.getFrameId(frame)].translation)

    def group(self, side: Side, positions: Mapping[str, float]) -> ArmGroup:
        """Return torso and one arm, with all other joints locked at the given positions [rad, or m]."""
        kept = group_joints(side)
        locked = [i for i in range(1, self.model.njoints) if self.model.names[i] not in kept]
        model, geometry = pin.buildReducedModel(self.model, self.geometry, locked, self.configuration(positions))
        if side not in self._grippers:
            self._grippers[side] = self.gripper(side)
        group = ArmGroup(side, model, geometry, self._grippers[side], reach=self._reach.get(side))
        self._reach[side] = group.reach
        if side not in self._pairs:
            self._pairs[side] = _pairs_to_check(model, geometry)
            self._clearance_maps[side] = load_clearance_maps(model, geometry, self._pairs[side])
        group.body_pairs, group.clearance_maps = self._pairs[side], self._clearance_maps[side]
        return group

    def gripper(self, side: Side) -> GripperShape:
        """Measure the collision shapes of a gripper in its grasping frame, with the fingers closed.

        Raises:
            RobotModelError: the grasping frame or collision shapes of the gripper are missing.
        """
        data = self.model.createData()
        gdata = self.geometry.createData()
        q = self.configuration({})
        pin.framesForwardKinematics(self.model, data, q)
        pin.updateGeometryPlacements(self.model, data, self.geometry, gdata)
        frame = f"gripper_{side}_grasping_frame"
        if not self.model.existFrame(frame):
            raise RobotModelError(f"/robot_description lacks the frame {frame}")
        base = data.oMf[self.model.getFrameId(frame)].inverse()
        boxes: dict[str, FloatArray] = {}
        for i, geometry in enumerate(self.geometry.geometryObjects):
            link = link_of_geometry(geometry.name)
            if link.startswith(f"gripper_{side}"):
                corners = _corners(geometry, base * gdata.oMg[i])
                key = "finger_a" if "right_finger" in link else "finger_b" if "left_finger" in link else "palm"
                boxes[key] = np.vstack([boxes[key], corners]) if key in boxes else corners
        if set(boxes) != {"finger_a", "finger_b", "palm"}:
            raise RobotModelError(f"the gripper on the {side} has no collision shapes for palm and both fingers")
        a, b, palm = boxes["finger_a"], boxes["finger_b"], boxes["palm"]
        if a[:, 1].mean() < b[:, 1].mean():
            a, b = b, a
        strokes = sum(
            float(self.model.upperPositionLimit[self.model.joints[self.model.getJointId(j)].idx_q])
            for j in finger_joints(side)
        )
        return GripperShape(
            tip=float(min(a[:, 0].max(), b[:, 0].max())),
            palm=float(palm[:, 0].max()),
            thickness=float(np.ptp(a[:, 1])),
            half_width=float(np.ptp(a[:, 2]) / 2.0),
            open=strokes + float(a[:, 1].min() - b[:, 1].max()),
            body=(float(np.abs(palm[:, 1]).max()), float(np.abs(palm[:, 2]).max())),
        )


def _hull(mesh: Any) -> Any:
    """Return the convex hull of a mesh, as a mesh; the controllers and simulators check no more than that.

    It stays a bounding volume hierarchy, as coal's own convex shapes miss contacts (coal issue 308).
    """
    vertices = np.array(mesh.vertices())
    hull = coal.BVHModelOBBRSS()
    triangles = ConvexHull(vertices).simplices
    hull.beginModel(len(triangles), len(vertices))
    for triangle in triangles:
        hull.addTriangle(*(vertices[i] for i in triangle))
    hull.endModel()
    return hull


def _pairs_to_check(model: Any, geometry: Any) -> tuple[tuple[int, int], ...]:
    """Return the pairs of collision shapes to check: without neighbours and pairs that never, or always, touch."""
    skipped = disabled_pairs() | adjacent_pairs(model, geometry)
    objects = list(geometry.geometryObjects)
    links = [link_of_geometry(g.name) for g in objects]
    return tuple(
        (i, j)
        for i, j in itertools.combinations(range(len(objects)), 2)
        if objects[i].parentJoint != objects[j].parentJoint and frozenset((links[i], links[j])) not in skipped
    )


def _ignored(geometry: Any) -> bool:
    """Tell whether a collision shape is of a small part of the base that no arm reaches."""
    return _IGNORED_LINKS.search(geometry.name) is not None


def _corners(geometry: Any, placement: Any) -> FloatArray:
    """Return the corners (8, 3) of a shape's local bounding box in the frame that its placement is given in [m]."""
    shape = geometry.geometry
    shape.computeLocalAABB()
    low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return np.asarray(corners @ placement.rotation.T + placement.translation)
