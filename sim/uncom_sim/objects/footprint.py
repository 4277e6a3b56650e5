# SPDX-License-Identifier: Apache-2.0
"""The room objects take on the table."""

from __future__ import annotations

import numpy as np
import shapely

from uncom_sim.objects.catalogue import model
from uncom_sim.types import Point2, SceneObject


def outline(thing: SceneObject) -> shapely.Polygon:
    """Return the outline of an object on the table, in base_footprint [m]."""
    c, s = np.cos(thing.yaw), np.sin(thing.yaw)
    local = model(thing.kind, thing.colour).footprint
    return shapely.Polygon(local @ np.array([[c, s], [-s, c]]) + [thing.x, thing.y])


def ground_point(thing: SceneObject) -> Point2:
    """Return the place below an object's centre of mass, in base_footprint [m]."""
    c, s = np.cos(thing.yaw), np.sin(thing.yaw)
    x, y, _ = model(thing.kind, thing.colour).centre_of_mass
    return float(thing.x + c * x - s * y), float(thing.y + s * x + c * y)
