# SPDX-License-Identifier: Apache-2.0
"""Tasks and scenes between odom and base_footprint (frames of REP 105).

A task lives in odom, which does not move with the base; arms are planned for in base_footprint. A plan for another
place of the base is made by giving that place's pose.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from uncom_common.transforms import apply, invert
from uncom_perception.types import Detection, Geometry, Scene, TableSurface

from uncom_tiago_exec.types import BasePose, FloatArray, ManipulationTask


def task_in_base(task: ManipulationTask, base: BasePose) -> ManipulationTask:
    """Return a task of odom as it is in base_footprint with the base at a pose."""
    return _task(task, invert(base.transform_base_to_odom))


def task_in_odom(task: ManipulationTask, base: BasePose) -> ManipulationTask:
    """Return a task of base_footprint as it is in odom with the base at a pose."""
    return _task(task, base.transform_base_to_odom)


def scene_in_odom(scene: Scene, base: BasePose) -> Scene:
    """Return what is seen in base_footprint as it is in odom with the base at a pose."""
    transform = base.transform_base_to_odom
    detections = tuple(_detection(detection, transform) for detection in scene.detections)
    return replace(scene, frame_id="odom", detections=detections, table=_table(scene.table, transform))


def _task(task: ManipulationTask, transform: FloatArray) -> ManipulationTask:
    return replace(
        task,
        object=_detection(task.object, transform),
        target=None if task.target is None else _detection(task.target, transform),
        scene=tuple(_detection(detection, transform) for detection in task.scene),
        table=_table(task.table, transform),
        target_pose=None if task.target_pose is None else transform @ task.target_pose,
    )


def _table(table: TableSurface | None, transform: FloatArray) -> TableSurface | None:
    if table is None:
        return None
    polygon = np.asarray(table.polygon, dtype=float).reshape(-1, 3)
    return replace(table, polygon=apply(transform, polygon), normal=table.normal @ transform[:3, :3].T)


def _detection(detection: Detection, transform: FloatArray) -> Detection:
    geometry, model = detection.geometry, detection.model
    return replace(
        detection,
        geometry=None if geometry is None else _geometry(geometry, transform),
        model=None if model is None else replace(model, pose=transform @ model.pose),
    )


def _geometry(geometry: Geometry, transform: FloatArray) -> Geometry:
    cloud = np.asarray(geometry.cloud)
    return replace(
        geometry,
        centroid=apply(transform, geometry.centroid),
        pose=transform @ geometry.pose,
        cloud=apply(transform, cloud.reshape(-1, 3)).astype(cloud.dtype),
    )
