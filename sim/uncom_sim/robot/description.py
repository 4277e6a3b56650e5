# SPDX-License-Identifier: Apache-2.0
"""The TIAGo++ that is simulated, as URDF text made in memory.

The arms, torso, head and base come from the installed package example-robot-data (`tiago_dual.urdf`, read at run
time and never copied); its two anthropomorphic hands are replaced by parallel grippers, and its camera frames
get the names they have on the robot.
"""

from __future__ import annotations

import importlib.metadata
import math
import os
import sys
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from uncom_sim.exceptions import SimError
from uncom_sim.robot.gripper import fixed_joint, gripper_elements

SIDES = ("left", "right")
CAMERA_FRAME = "head_front_camera_rgb_optical_frame"
PACKAGE = "example-robot-data"
_URDF = Path("robots/tiago_description/robots/tiago_dual.urdf")
_OPTICAL = (-math.pi / 2, 0.0, -math.pi / 2)


@lru_cache(maxsize=1)
def package_directory() -> Path:
    """Return the folder in which `package://example-robot-data/...` is found.

    Raises:
        SimError: example-robot-data is not installed.
    """
    shares = [Path(p) / "share" for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    shares += [Path(entry) / "cmeel.prefix/share" for entry in sys.path if entry]
    try:
        distribution = importlib.metadata.distribution(PACKAGE)
        shares.insert(0, Path(str(distribution.locate_file("cmeel.prefix/share"))))
    except importlib.metadata.PackageNotFoundError:
        pass
    for share in shares:
        if (share / PACKAGE / _URDF).is_file():
            return share
    raise SimError("the robot's model is missing: install it with: pip install example-robot-data")


def _is_hand(name: str) -> bool:
    return name.startswith(("hand_left_", "hand_right_"))


def _remove_unused_elements(robot: ET.Element) -> None:
    """Drop the hands, the old camera frames, and what only Gazebo and ROS 1 read."""
    for element in list(robot):
        name = element.get("name", "")
        if element.tag in ("gazebo", "transmission") or _is_hand(name) or name.startswith("xtion_"):
            robot.remove(element)
            continue
        for calibration in element.findall("calibration"):
            element.remove(calibration)


def _repair_inertias(robot: ET.Element) -> None:
    """Give links whose inertia no solid body can have (zero, indefinite) one that a small ball would have."""
    for link in robot.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass = float(inertial.find("mass").get("value", "0"))  # type: ignore[union-attr]
        if mass <= 0.0:
            link.remove(inertial)
            continue
        tensor = inertial.find("inertia")
        if tensor is None:
            continue
        xx, xy, xz, yy, yz, zz = (float(tensor.get(f"i{key}", "0")) for key in ("xx", "xy", "xz", "yy", "yz", "zz"))
        principal = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        if principal[0] > 0.0 and principal[0] + principal[1] > 1.02 * principal[2]:
            continue
        ball = max(float(principal[2]), 0.4 * mass * 0.02**2)
        for key in ("xy", "xz", "yz"):
            tensor.set(f"i{key}", "0")
        for key in ("xx", "yy", "zz"):
            tensor.set(f"i{key}", f"{ball:.8g}")


def _camera_elements() -> list[ET.Element]:
    """Return the frames of the head camera, with PAL's names and places."""
    camera = "head_front_camera"
    none = (0.0, 0.0, 0.0)
    frames: list[tuple[str, str, str, tuple[float, float, float], tuple[float, float, float]]] = [
        (f"{camera}_joint", "head_2_link", f"{camera}_link", (0.0908, 0.08, 0.0), (-math.pi / 2, 0.0, 0.0)),
        (f"{camera}_optical_joint", f"{camera}_link", f"{camera}_optical_frame", none, _OPTICAL),
        (f"{camera}_orbbec_aux_joint", f"{camera}_link", f"{camera}_orbbec_aux_joint_frame", none, none),
        (
            f"{camera}_rgb_joint",
            f"{camera}_orbbec_aux_joint_frame",
            f"{camera}_rgb_frame",
            (0.0, 0.022, 0.0),
            none,
        ),
        (f"{camera}_rgb_optical_joint", f"{camera}_rgb_frame", CAMERA_FRAME, none, _OPTICAL),
        (f"{camera}_depth_joint", f"{camera}_rgb_frame", f"{camera}_depth_frame", (0.0, 0.025, 0.0), none),
        (
            f"{camera}_depth_optical_joint",
            f"{camera}_depth_frame",
            f"{camera}_depth_optical_frame",
            none,
            _OPTICAL,
        ),
    ]
    elements: list[ET.Element] = []
    for name, parent, child, xyz, rpy in frames:
        elements += [ET.Element("link", name=child), fixed_joint(name, parent, child, xyz, rpy)]
    return elements


@lru_cache(maxsize=1)
def tiago_urdf() -> str:
    """Return the URDF of the TIAGo++ with two parallel grippers.

    Meshes are named `package://example-robot-data/...`; see `package_directory`. Frames and joints have the names
    and limits they have on the robot; less than 128 joints, which is what PyBullet can read.

    Raises:
        SimError: example-robot-data is missing or its URDF is not the one known.
    """
    try:
        robot = ET.parse(package_directory() / PACKAGE / _URDF).getroot()  # noqa: S314  (an installed package's file)
    except ET.ParseError as err:
        raise SimError("the robot's URDF in example-robot-data cannot be read: install version 6.0.0 of it") from err
    _remove_unused_elements(robot)
    links = {link.get("name") for link in robot.findall("link")}
    needed = {"head_2_link", *(f"wrist_{side}_ft_tool_link" for side in SIDES)}
    if not needed <= links:
        raise SimError("the robot's URDF in example-robot-data has changed: install version 6.0.0 of it")
    robot.extend(_camera_elements())
    for side in SIDES:
        robot.extend(gripper_elements(side, f"wrist_{side}_ft_tool_link"))
    _repair_inertias(robot)
    robot.set("name", "tiago_dual")
    ET.indent(robot)  # PyBullet misreads very long lines
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode")
