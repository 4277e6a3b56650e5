# SPDX-License-Identifier: Apache-2.0
"""The URDF that PyBullet simulates: the same shapes and masses in fewer links.

Every fixed link becomes part of the link that carries it, which halves the cost of a physics step, and wheels,
casters and suspension become part of the base, which moves on three planar joints (x, y, yaw) instead of rolling:
contacts of small wheels on a plane disturb every other joint in PyBullet.
"""

from __future__ import annotations

from copy import deepcopy
from xml.etree import ElementTree as ET

import numpy as np
from uncom_common.transforms import FloatArray

from uncom_sim.robot.kinematics import Joint, joint_from_element, origin_matrix, set_origin
from uncom_sim.robot.options import JOINT_DRIVES, JointDriveOptions

BASE_JOINTS = ("base_x", "base_y", "base_yaw")
ROOT = "base_footprint"
_ROLLING = ("wheel_", "caster_", "suspension_")


def physics_urdf(urdf: str, *, options: JointDriveOptions = JOINT_DRIVES) -> str:
    """Return a URDF with the same shapes and masses, without fixed joints, on a planar base."""
    robot = ET.fromstring(urdf)  # noqa: S314  (our own text)
    links = {link.get("name", ""): link for link in robot.findall("link")}
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    for name, joint in joints.items():
        if name.startswith(_ROLLING):
            joint.set("type", "fixed")
    for name, link in links.items():
        if name.startswith(_ROLLING):
            for collision in link.findall("collision"):
                link.remove(collision)
    parents = {j.child: j for j in map(joint_from_element, joints.values())}
    carriers = {name: _carrier(name, parents) for name in links}
    _merge_links(links, carriers)
    for name, joint in joints.items():
        if joint.get("type") == "fixed":
            robot.remove(joint)
            continue
        parent = joint.find("parent")
        assert parent is not None, name  # noqa: S101  (read above)
        carrier, matrix = carriers[parent.get("link", "")]
        set_origin(joint, matrix @ origin_matrix(joint))
        parent.set("link", carrier)
    for name, link in links.items():
        if carriers[name][0] != name:
            robot.remove(link)
    robot.extend(_planar_base(options=options))
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode")


def _carrier(link: str, parents: dict[str, Joint]) -> tuple[str, FloatArray]:
    """Return the moving link that a link is fixed to and transform_link_to_carrier."""
    matrix = np.eye(4)
    while True:
        joint = parents.get(link)
        if joint is None or joint.moves:
            return link, matrix
        matrix = joint.origin @ matrix
        link = joint.parent


def _merge_links(links: dict[str, ET.Element], carriers: dict[str, tuple[str, FloatArray]]) -> None:
    """Move shapes and inertias of fixed links to their carriers."""
    bodies: dict[str, list[tuple[float, FloatArray, FloatArray]]] = {}
    for name, link in links.items():
        carrier, matrix = carriers[name]
        inertial = link.find("inertial")
        if inertial is not None:
            bodies.setdefault(carrier, []).append(_read_inertial(inertial, matrix))
            link.remove(inertial)
        if carrier == name:
            continue
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            moved = deepcopy(shape)
            set_origin(moved, matrix @ origin_matrix(shape))
            links[carrier].append(moved)
    for name, parts in bodies.items():
        links[name].append(_inertial(*_combine(parts)))


def _read_inertial(inertial: ET.Element, matrix: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return mass, centre (3,) and tensor (3, 3) about the centre, in the carrier's axes."""
    frame = matrix @ origin_matrix(inertial)
    mass = float(inertial.find("mass").get("value", "0"))  # type: ignore[union-attr]
    t = inertial.find("inertia")
    assert t is not None  # noqa: S101  (every inertial of the model has one)
    xx, xy, xz, yy, yz, zz = (float(t.get(f"i{key}", "0")) for key in ("xx", "xy", "xz", "yy", "yz", "zz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return mass, frame[:3, 3], frame[:3, :3] @ tensor @ frame[:3, :3].T


def _combine(parts: list[tuple[float, FloatArray, FloatArray]]) -> tuple[float, FloatArray, FloatArray]:
    """Add up bodies (parallel axis theorem)."""
    mass = sum(part[0] for part in parts)
    centre = np.asarray(sum(part[0] * part[1] for part in parts)) / mass
    tensor = np.zeros((3, 3))
    for part_mass, part_centre, part_tensor in parts:
        d = part_centre - centre
        tensor += part_tensor + part_mass * (float(d @ d) * np.eye(3) - np.outer(d, d))
    return mass, centre, tensor


def _inertial(mass: float, centre: FloatArray, tensor: FloatArray) -> ET.Element:
    element = ET.Element("inertial")
    matrix = np.eye(4)
    matrix[:3, 3] = centre
    set_origin(element, matrix)
    ET.SubElement(element, "mass", value=f"{mass:.8g}")
    pairs = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
    ET.SubElement(element, "inertia", {f"i{key}": f"{tensor[index]:.8g}" for key, index in pairs.items()})
    return element


def _planar_base(*, options: JointDriveOptions = JOINT_DRIVES) -> list[ET.Element]:
    """Return world -> x -> y -> yaw -> base_footprint."""
    chain = [("world", "base_x", "prismatic", "1 0 0"), ("base_x_link", "base_y", "prismatic", "0 1 0")]
    chain.append(("base_y_link", "base_yaw", "continuous", "0 0 1"))
    elements = [ET.Element("link", name="world")]
    for parent, name, kind, axis in chain:
        child = ROOT if name == "base_yaw" else f"{name}_link"
        joint = ET.Element("joint", name=name, type=kind)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        ET.SubElement(joint, "axis", xyz=axis)
        effort = options.base_efforts[BASE_JOINTS.index(name)]
        ET.SubElement(joint, "limit", lower="-100", upper="100", effort=f"{effort}", velocity="2.1")
        elements.append(joint)
        if child != ROOT:
            link = ET.Element("link", name=child)
            link.append(_inertial(1.0, np.zeros(3), 0.1 * np.eye(3)))
            elements.append(link)
    return elements
