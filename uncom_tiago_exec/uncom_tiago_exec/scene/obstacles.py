# SPDX-License-Identifier: Apache-2.0
"""The scene as solids: the table, every object as few boxes and cylinders, and what is held in the hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from uncom_common.transforms import invert
from uncom_perception.types import LEAST_CORNERS, TableSurface

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.scene.object_shape import ObjectShape, Rim, smallest_rectangle
from uncom_tiago_exec.scene.options import SOLIDS, SolidOptions
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle

TABLE = "table"


def table_obstacle(table: TableSurface | None, options: SolidOptions = SOLIDS) -> Obstacle:
    """Return the table top as a box, a little wider than seen.

    Raises:
        RefusedError: no table was seen.
    """
    if table is None or len(table.polygon) < LEAST_CORNERS:
        raise RefusedError("I do not see the table, so I cannot move safely")
    centre, yaw, extent = smallest_rectangle(np.asarray(table.polygon)[:, :2])
    border, thickness = options.table_border_m, options.table_thickness_m
    size = (float(extent[0]) + 2 * border, float(extent[1]) + 2 * border, thickness)
    middle = np.array([centre[0], centre[1], table.height_m - thickness / 2.0])
    return Obstacle(TABLE, "box", size, make_upright_pose(middle, yaw))


def make_upright_pose(position: FloatArray, yaw: float) -> FloatArray:
    """Return the pose (4, 4) at a position (3,) turned by yaw about the vertical."""
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = position
    return pose


def enclose_shape(
    shape: ObjectShape, name: str | None = None, pad: float | None = None, options: SolidOptions = SOLIDS
) -> tuple[Obstacle, ...]:
    """Return boxes and cylinders that hold a shape.

    Args:
        shape: to hold.
        name: of all solids; the shape's own if it is None.
        pad: added all around [m]; that of the options if it is None.
        options: how fine they are.
    """
    name = name or shape.name
    pad = options.pad_m if pad is None else pad
    if shape.axis is None:
        return tuple(_boxes(name, shape.points, shape.bottom, pad, options.splits, options))
    centre, radius = shape.axis.centre, shape.axis.radius
    distance = np.linalg.norm(shape.points[:, :2] - centre, axis=1)
    body = distance <= radius + options.body_beyond_m
    if shape.rim is not None and is_shallow(shape.rim, options):
        solids = _dish(name, shape.rim, distance[body], shape.points[body, 2], shape.bottom, pad, options)
    else:
        solids = _discs(name, centre, distance[body], shape.points[body, 2], shape.bottom, pad, options)
    rest = shape.points[~body]
    if len(rest) >= options.least_rest_points:
        solids += _boxes(name, rest, float(rest[:, 2].min()), pad, 0, options)
    return tuple(solids)


def is_shallow(rim: Rim, options: SolidOptions = SOLIDS) -> bool:
    """Tell whether an opening is that of a flat dish, which objects are put on, not into."""
    return rim.z - rim.floor_z < options.shallow_m


def _dish(
    name: str, rim: Rim, distance: FloatArray, z: FloatArray, bottom: float, pad: float, options: SolidOptions
) -> list[Obstacle]:
    """Hold a flat dish by the disc of its floor and a ring of boxes for its border, so that objects fit into it.

    distance and z (N,) are those of its points from its axis and their heights [m].
    """
    outer = max(rim.radius, float(np.quantile(distance, options.outer_quantile))) + pad
    border = distance[z > rim.floor_z + options.border_from * (rim.z - rim.floor_z)]
    seen = len(border) > options.least_border_points
    inner = float(np.quantile(border, options.inner_quantile)) - pad if seen else options.unseen_inner * outer
    inner = min(max(inner, options.least_inner * outer), outer - options.least_border_m)
    floor = max(rim.floor_z - bottom, options.least_floor_m)
    solids = [
        Obstacle(
            name,
            "cylinder",
            (2.0 * outer, 2.0 * outer, floor),
            make_upright_pose(np.array([*rim.centre, bottom + floor / 2]), 0),
        )
    ]
    height = rim.z - bottom + pad
    count = options.ring_boxes
    middle, across = 0.5 * (inner + outer), 2.0 * outer * np.tan(np.pi / count)
    for angle in np.arange(count) * 2.0 * np.pi / count:
        xy = rim.centre + middle * np.array([np.cos(angle), np.sin(angle)])
        size = (outer - inner, float(across), height)
        solids.append(
            Obstacle(name, "box", size, make_upright_pose(np.array([*xy, bottom + height / 2.0]), float(angle)))
        )
    return solids


def _discs(
    name: str, centre: FloatArray, distance: FloatArray, z: FloatArray, bottom: float, pad: float, options: SolidOptions
) -> list[Obstacle]:
    """Stack a few cylinders along the height; neighbours of like radius become one."""
    top = float(z.max())
    edges = np.linspace(bottom, top, 1 + (options.tall_discs if top - bottom > options.tall_m else 1))
    parts: list[tuple[float, float, float]] = []
    for low, high in pairwise(edges):
        inside = (z >= low - options.disc_overlap_m) & (z <= high + options.disc_overlap_m)
        radius = float(distance[inside].max()) if inside.any() else options.empty_disc_m
        if parts and abs(parts[-1][2] - radius) < options.like_radius_m:
            parts[-1] = (parts[-1][0], high, max(parts[-1][2], radius))
        else:
            parts.append((low, high, radius))
    solids = []
    for low, high, radius in parts:
        size = (2.0 * (radius + pad), 2.0 * (radius + pad), high - low + pad)
        middle = np.array([centre[0], centre[1], 0.5 * (low + high + pad)])
        solids.append(Obstacle(name, "cylinder", size, make_upright_pose(middle, 0.0)))
    return solids


def _boxes(
    name: str, points: FloatArray, bottom: float, pad: float, splits: int, options: SolidOptions
) -> list[Obstacle]:
    """Hold points (N, 3) by one upright box, or by two halves, `splits` times, where that saves much room."""
    centre, yaw, extent = smallest_rectangle(points[:, :2])
    top = float(points[:, 2].max())
    if splits > 0 and len(points) > options.least_split_points:
        along = (points[:, :2] - centre) @ np.array([np.cos(yaw), np.sin(yaw)])
        halves = [points[along < 0.0], points[along >= 0.0]]
        if all(len(half) > options.least_half_points for half in halves):
            volume = 0.0
            for half in halves:
                _, _, part = smallest_rectangle(half[:, :2])
                volume += float(part[0] * part[1] * (half[:, 2].max() - bottom))
            if volume < options.split_below * float(extent[0] * extent[1] * (top - bottom)):
                return [box for half in halves for box in _boxes(name, half, bottom, pad, splits - 1, options)]
    height = max(top - bottom, options.least_height_m) + pad
    size = (float(extent[0]) + 2 * pad, float(extent[1]) + 2 * pad, height)
    middle = np.array([centre[0], centre[1], bottom + size[2] / 2.0])
    return [Obstacle(name, "box", size, make_upright_pose(middle, yaw))]


def attach(solids: tuple[Obstacle, ...], hand: FloatArray, options: SolidOptions = SOLIDS) -> Attachment:
    """Fix solids to a hand pose (4, 4); their bottoms are raised a little so that the table is not touched."""
    to_hand, clearance = invert(hand), options.held_clearance_m
    parts = []
    for solid in solids:
        size = (solid.size[0], solid.size[1], max(solid.size[2] - clearance, options.least_height_m))
        pose = solid.pose.copy()
        pose[2, 3] += clearance / 2.0
        parts.append(Obstacle(solid.name, solid.shape, size, to_hand @ pose))
    return Attachment(tuple(parts))


def is_on_table(table: TableSurface, xy: FloatArray, margin: float) -> bool:
    """Tell whether a place (2,) lies on the table, at least `margin` [m] inside its outline."""
    outline = shapely.Polygon(np.asarray(table.polygon)[:, :2]).buffer(-margin)
    return bool(outline.contains(shapely.Point(float(xy[0]), float(xy[1]))))
