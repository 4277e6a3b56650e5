# SPDX-License-Identifier: Apache-2.0
"""A parallel gripper of our own modelling with PAL's names, stroke, limits and frames.

In `gripper_<side>_link` the approach direction is -z and the fingers slide along x: the left finger opens
towards -x, the right one towards +x. The gap between the pads is the sum of both finger positions.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree as ET

from uncom_sim.robot.options import GRIPPER, GripperModel

_LIGHT = ("GripperLight", "0.86 0.86 0.88 1")
_DARK = ("GripperDark", "0.16 0.16 0.18 1")

Triple = tuple[float, float, float]


def _text(values: Triple) -> str:
    return " ".join(f"{v:.10g}" for v in values)


def _shape(link: ET.Element, kinds: tuple[str, ...], size: Triple, centre: Triple, material: tuple[str, str]) -> None:
    """Add a box as visual, collision or both."""
    for kind in kinds:
        element = ET.SubElement(link, kind)
        ET.SubElement(element, "origin", xyz=_text(centre), rpy="0 0 0")
        ET.SubElement(ET.SubElement(element, "geometry"), "box", size=_text(size))
        if kind == "visual":
            ET.SubElement(ET.SubElement(element, "material", name=material[0]), "color", rgba=material[1])


def _inertial(link: ET.Element, mass: float, centre: Triple, size: Triple) -> None:
    """Add the inertia of a box."""
    element = ET.SubElement(link, "inertial")
    ET.SubElement(element, "origin", xyz=_text(centre), rpy="0 0 0")
    ET.SubElement(element, "mass", value=f"{mass:.10g}")
    x, y, z = (s * s for s in size)
    ixx, iyy, izz = (mass / 12.0 * pair for pair in (y + z, x + z, x + y))
    ET.SubElement(element, "inertia", ixx=f"{ixx:.6g}", ixy="0", ixz="0", iyy=f"{iyy:.6g}", iyz="0", izz=f"{izz:.6g}")


def fixed_joint(name: str, parent: str, child: str, xyz: Triple, rpy: Triple) -> ET.Element:
    """Make a fixed joint."""
    joint = ET.Element("joint", name=name, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=_text(xyz), rpy=_text(rpy))
    return joint


def _finger_joint(
    name: str, parent: str, child: str, direction: float, *, options: GripperModel = GRIPPER
) -> ET.Element:
    joint = ET.Element("joint", name=name, type="prismatic")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz="0 0 0", rpy="0 0 0")
    ET.SubElement(joint, "axis", xyz=_text((direction, 0.0, 0.0)))
    ET.SubElement(
        joint,
        "limit",
        lower="0",
        upper=f"{options.stroke_m}",
        effort=f"{options.effort_n}",
        velocity=f"{options.speed_m_s}",
    )
    ET.SubElement(joint, "dynamics", damping="2.0", friction="0.0")
    ET.SubElement(
        joint,
        "safety_controller",
        k_position="20",
        k_velocity="20",
        soft_lower_limit=f"{options.soft_limit_margin_m}",
        soft_upper_limit=f"{options.stroke_m - options.soft_limit_margin_m}",
    )
    return joint


def _palm(name: str, *, options: GripperModel = GRIPPER) -> ET.Element:
    link = ET.Element("link", name=name)
    _inertial(link, options.palm_mass_kg, (0.0, 0.0, -0.033), (0.10, 0.07, 0.10))
    _shape(link, ("visual", "collision"), (0.056, 0.056, 0.026), (0.0, 0.0, -0.008), _DARK)
    _shape(link, ("visual", "collision"), (0.1032, 0.064, 0.07), (0.0, 0.0, -0.056), _LIGHT)
    _shape(link, ("visual",), (0.096, 0.03, 0.008), (0.0, 0.0, -0.094), _DARK)
    return link


def _finger(name: str, direction: float, *, options: GripperModel = GRIPPER) -> ET.Element:
    """Make a finger whose pad's inner face lies in the plane x = 0 of the link."""
    link = ET.Element("link", name=name)
    _inertial(link, options.finger_mass_kg, (0.008 * direction, 0.0, -0.14), (0.016, 0.05, 0.14))
    thickness, width, length = options.pad_size_m
    _shape(link, ("collision",), options.pad_size_m, (direction * thickness / 2, 0.0, options.pad_centre_z_m), _DARK)
    # What is seen: a rubber pad on a metal back that tapers towards the tip, on a carriage.
    pad = (0.004, width - 0.004, length - 0.004)
    _shape(link, ("visual",), pad, (direction * 0.002, 0.0, options.pad_centre_z_m), _DARK)
    back = (0.006, width, length)
    _shape(link, ("visual",), back, (direction * 0.007, 0.0, options.pad_centre_z_m), _LIGHT)
    carriage = (0.016, 0.03, 0.026)
    _shape(link, ("visual",), carriage, (direction * 0.010, 0.0, -0.108), _DARK)
    return link


def gripper_elements(side: str, parent: str, *, options: GripperModel = GRIPPER) -> list[ET.Element]:
    """Return the links and joints of the gripper on a side ("left" or "right"), fixed to a parent link."""
    name = f"gripper_{side}"
    mount: tuple[Triple, Triple] = ((0.01, 0.0, 0.0), (math.pi / 2, math.pi / 2, -math.pi / 2))
    elements = [
        ET.Element("link", name=f"{name}_tool_link"),
        fixed_joint(f"{name}_tool_joint", parent, f"{name}_tool_link", *mount),
        _palm(f"{name}_link", options=options),
        fixed_joint(f"{name}_joint", parent, f"{name}_link", *mount),
    ]
    for finger, direction in (("right", 1.0), ("left", -1.0)):
        child = f"{name}_{finger}_finger"
        elements += [
            _finger(f"{child}_link", direction, options=options),
            _finger_joint(f"{child}_joint", f"{name}_link", f"{child}_link", direction, options=options),
        ]
    frame = f"{name}_grasping_frame"
    # x of the grasping frame is the approach direction, y the opening axis (towards the left finger).
    turn: Triple = (-math.pi / 2, math.pi / 2, 0.0)
    elements += [
        ET.Element("link", name=frame),
        fixed_joint(f"{frame}_joint", f"{name}_link", frame, (0.0, 0.0, options.grasping_frame_z_m), turn),
    ]
    return elements
