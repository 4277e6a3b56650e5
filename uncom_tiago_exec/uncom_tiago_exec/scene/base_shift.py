# SPDX-License-Identifier: Apache-2.0
"""A scene as it is seen after the base has driven straight ahead, and how far it can drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from uncom_perception.types import Detection, TableSurface

from uncom_tiago_exec.types import ManipulationTask

STEPS = (0.06, 0.12)  # [m] tried in this order
_FRONT = 0.30  # [m] from base_footprint to the front of the base, with some room


def room_ahead(table: TableSurface | None) -> float:
    """Return how far the base can go before its front would be under the edge of the table [m]."""
    if table is None or len(table.polygon) == 0:
        return 0.0
    return float(np.asarray(table.polygon)[:, 0].min()) - _FRONT


def seen_from(task: ManipulationTask, ahead: float) -> ManipulationTask:
    """Return the same task as it looks from `ahead` [m] farther on: everything is that much nearer."""
    table = task.table
    if table is not None:
        polygon = np.asarray(table.polygon) - [ahead, 0.0, 0.0]
        table = replace(table, polygon=polygon)
    pose = task.target_pose
    if pose is not None:
        pose = pose.copy()
        pose[0, 3] -= ahead
    return replace(
        task,
        object=_moved(task.object, ahead),
        target=None if task.target is None else _moved(task.target, ahead),
        scene=tuple(_moved(d, ahead) for d in task.scene),
        table=table,
        target_pose=pose,
    )


def _moved(thing: Detection, ahead: float) -> Detection:
    geometry = thing.geometry
    if geometry is None:
        return thing
    shift = np.array([ahead, 0.0, 0.0])
    pose = geometry.pose.copy()
    pose[:3, 3] -= shift
    cloud = (np.asarray(geometry.cloud) - shift).astype(np.asarray(geometry.cloud).dtype)
    return replace(thing, geometry=replace(geometry, centroid=geometry.centroid - shift, pose=pose, cloud=cloud))
