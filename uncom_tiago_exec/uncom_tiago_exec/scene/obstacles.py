# SPDX-License-Identifier: Apache-2.0
"""The scene as solids: the table, every object as few boxes and cylinders, and what is held in the hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from uncom_common.transforms import invert
from uncom_perception.types import TableSurface

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.scene.object_shape import ObjectShape, Rim, smallest_rectangle
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle

TABLE = "table"
PAD = 0.003  # [m] added all around, for what the camera gets wrong
SHALLOW = 0.035  # [m] a dish less deep than this is put on, not into
_SIDES = 12  # boxes that make a ring
_TABLE_THICKNESS = 0.08
_TABLE_BORDER = 0.03


def table_obstacle(table: TableSurface | None) -> Obstacle:
    """Return the table top as a box, a little wider than seen.

    Raises:
        RefusedError: no table was seen.
    """
    if table is None or len(table.polygon) < 3:
        raise RefusedError("I do not see the table, so I cannot move safely")
    centre, yaw, extent = smallest_rectangle(np.asarray(table.polygon)[:, :2])
    size = (float(extent[0]) + 2 * _TABLE_BORDER, float(extent[1]) + 2 * _TABLE_BORDER, _TABLE_THICKNESS)
    middle = np.array([centre[0], centre[1], table.height_m - _TABLE_THICKNESS / 2.0])
    return Obstacle(TABLE, "box", size, upright(middle, yaw))


def upright(position: FloatArray, yaw: float) -> FloatArray:
    """Return the pose (4, 4) at a position (3,) turned by yaw about the vertical."""
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = position
    return pose


def solids_of(shape: ObjectShape, name: str | None = None, pad: float = PAD) -> tuple[Obstacle, ...]:
    """Return boxes and cylinders that hold a shape, all under one name."""
    name = name or shape.name
    if shape.axis is None:
        return tuple(_boxes(name, shape.points, shape.bottom, pad, 2))
    centre, radius = shape.axis.centre, shape.axis.radius
    distance = np.linalg.norm(shape.points[:, :2] - centre, axis=1)
    body = distance <= radius + 0.006
    if shape.rim is not None and shape.rim.z - shape.rim.floor_z < SHALLOW:
        solids = _dish(name, shape.rim, distance[body], shape.points[body, 2], shape.bottom, pad)
    else:
        solids = _discs(name, centre, distance[body], shape.points[body, 2], shape.bottom, pad)
    rest = shape.points[~body]
    if len(rest) >= 4:
        solids += _boxes(name, rest, float(rest[:, 2].min()), pad, 0)
    return tuple(solids)


def _dish(name: str, rim: Rim, distance: FloatArray, z: FloatArray, bottom: float, pad: float) -> list[Obstacle]:
    """Hold a flat dish by the disc of its floor and a ring of boxes for its border, so that things fit into it."""
    outer = max(rim.radius, float(np.quantile(distance, 0.98))) + pad
    border = distance[z > rim.floor_z + 0.3 * (rim.z - rim.floor_z)]
    inner = float(np.quantile(border, 0.05)) - pad if len(border) > 8 else 0.8 * outer
    inner = min(max(inner, 0.4 * outer), outer - 0.01)
    floor = max(rim.floor_z - bottom, 0.004)
    solids = [
        Obstacle(
            name, "cylinder", (2.0 * outer, 2.0 * outer, floor), upright(np.array([*rim.centre, bottom + floor / 2]), 0)
        )
    ]
    height = rim.z - bottom + pad
    middle, across = 0.5 * (inner + outer), 2.0 * outer * np.tan(np.pi / _SIDES)
    for angle in np.arange(_SIDES) * 2.0 * np.pi / _SIDES:
        xy = rim.centre + middle * np.array([np.cos(angle), np.sin(angle)])
        size = (outer - inner, float(across), height)
        solids.append(Obstacle(name, "box", size, upright(np.array([*xy, bottom + height / 2.0]), float(angle))))
    return solids


def _discs(
    name: str, centre: FloatArray, distance: FloatArray, z: FloatArray, bottom: float, pad: float
) -> list[Obstacle]:
    """Stack up to three cylinders along the height; neighbours of like radius become one."""
    top = float(z.max())
    edges = np.linspace(bottom, top, 4 if top - bottom > 0.08 else 2)
    parts: list[tuple[float, float, float]] = []
    for low, high in pairwise(edges):
        inside = (z >= low - 0.005) & (z <= high + 0.005)
        radius = float(distance[inside].max()) if inside.any() else 0.01
        if parts and abs(parts[-1][2] - radius) < 0.012:
            parts[-1] = (parts[-1][0], high, max(parts[-1][2], radius))
        else:
            parts.append((low, high, radius))
    solids = []
    for low, high, radius in parts:
        size = (2.0 * (radius + pad), 2.0 * (radius + pad), high - low + pad)
        middle = np.array([centre[0], centre[1], 0.5 * (low + high + pad)])
        solids.append(Obstacle(name, "cylinder", size, upright(middle, 0.0)))
    return solids


def _boxes(name: str, points: FloatArray, bottom: float, pad: float, splits: int) -> list[Obstacle]:
    """Hold points by one upright box, or by two halves where that saves much room."""
    centre, yaw, extent = smallest_rectangle(points[:, :2])
    top = float(points[:, 2].max())
    if splits > 0 and len(points) > 40:
        along = (points[:, :2] - centre) @ np.array([np.cos(yaw), np.sin(yaw)])
        halves = [points[along < 0.0], points[along >= 0.0]]
        if all(len(half) > 10 for half in halves):
            volume = 0.0
            for half in halves:
                _, _, part = smallest_rectangle(half[:, :2])
                volume += float(part[0] * part[1] * (half[:, 2].max() - bottom))
            if volume < 0.75 * float(extent[0] * extent[1] * (top - bottom)):
                return [box for half in halves for box in _boxes(name, half, bottom, pad, splits - 1)]
    size = (float(extent[0]) + 2 * pad, float(extent[1]) + 2 * pad, max(top - bottom, 0.002) + pad)
    middle = np.array([centre[0], centre[1], bottom + size[2] / 2.0])
    return [Obstacle(name, "box", size, upright(middle, yaw))]


def attach(solids: tuple[Obstacle, ...], hand: FloatArray, clearance: float = 0.002) -> Attachment:
    """Fix solids to a hand pose (4, 4); their bottoms are raised by `clearance` so that the table is not touched."""
    to_hand = invert(hand)
    parts = []
    for solid in solids:
        size = (solid.size[0], solid.size[1], max(solid.size[2] - clearance, 0.002))
        pose = solid.pose.copy()
        pose[2, 3] += clearance / 2.0
        parts.append(Obstacle(solid.name, solid.shape, size, to_hand @ pose))
    return Attachment(tuple(parts))


def on_table(table: TableSurface, xy: FloatArray, margin: float) -> bool:
    """Tell whether a place (2,) lies on the table, at least `margin` [m] inside its outline."""
    outline = shapely.Polygon(np.asarray(table.polygon)[:, :2]).buffer(-margin)
    return bool(outline.contains(shapely.Point(float(xy[0]), float(xy[1]))))
