# SPDX-License-Identifier: Apache-2.0
"""Outlines of objects on the table."""

from __future__ import annotations

import numpy as np
import shapely

from uncom_sim.objects.catalogue import model
from uncom_sim.types import Point2, SceneObject


def outline(obj: SceneObject) -> shapely.Polygon:
    """Return the outline of an object on the table, in base_footprint [m]."""
    c, s = np.cos(obj.yaw), np.sin(obj.yaw)
    local = model(obj.kind, obj.colour).footprint
    return shapely.Polygon(local @ np.array([[c, s], [-s, c]]) + [obj.x, obj.y])


def ground_point(obj: SceneObject) -> Point2:
    """Return the place below an object's centre of mass, in base_footprint [m]."""
    c, s = np.cos(obj.yaw), np.sin(obj.yaw)
    x, y, _ = model(obj.kind, obj.colour).centre_of_mass
    return float(obj.x + c * x - s * y), float(obj.y + s * x + c * y)
