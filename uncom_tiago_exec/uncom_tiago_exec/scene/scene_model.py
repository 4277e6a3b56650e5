# SPDX-License-Identifier: Apache-2.0
"""Everything on the table of one task, as shapes and solids under unique names."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

import numpy as np
from uncom_perception.types import Detection

from uncom_tiago_exec.exceptions import ExecutionError
from uncom_tiago_exec.scene.object_shape import ObjectShape, complete_detection
from uncom_tiago_exec.scene.obstacles import enclose_shape, table_obstacle
from uncom_tiago_exec.scene.options import SCENE_MATCHING, SOLIDS, SceneMatchingOptions
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Obstacle

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SceneModel:
    """The object to move, the receiving object (or None), the other objects, and the table as solids.

    shadows are solids in the space that is not seen, which motions are to keep out of.
    """

    moved: ObjectShape
    target: ObjectShape | None
    others: tuple[ObjectShape, ...]
    table: Obstacle
    table_z: float
    shadows: tuple[Obstacle, ...] = ()
    _solids: dict[str, tuple[Obstacle, ...]] = field(  # made once; another scene makes its own
        init=False, default_factory=dict, repr=False, compare=False
    )

    @property
    def neighbours(self) -> FloatArray:
        """Points (N, 3) of everything but the object to move."""
        parts = [s.points for s in (*self.others, *((self.target,) if self.target else ()))]
        return np.vstack(parts) if parts else np.zeros((0, 3))

    def obstacles(self, *, with_moved: bool) -> tuple[Obstacle, ...]:
        """Return all solids, with or without the object to move."""
        if not self._solids:
            shapes = [*self.others, *((self.target,) if self.target else ())]
            self._solids["still"] = tuple(solid for shape in shapes for solid in enclose_shape(shape))
            self._solids["moved"] = enclose_shape(self.moved)
            self._solids["held"] = enclose_shape(self.moved, pad=SOLIDS.held_pad_m)
        moved = self._solids["moved"] if with_moved else ()
        return (self.table, *self._solids["still"], *self.shadows, *moved)

    @property
    def moved_solids(self) -> tuple[Obstacle, ...]:
        """Return the solids of the object to move, nearly without padding, where it stands."""
        self.obstacles(with_moved=False)
        return self._solids["held"]


def replace_moved(scene: SceneModel, moved: ObjectShape) -> SceneModel:
    """Return the same scene with another object to move: one that is in the hand already."""
    return SceneModel(moved, scene.target, scene.others, scene.table, scene.table_z)


def build_scene(task: ManipulationTask, options: SceneMatchingOptions = SCENE_MATCHING) -> SceneModel:
    """Complete every detection of a task.

    Raises:
        RefusedError: no table, or the object is seen without depth.
    """
    table = table_obstacle(task.table)
    if task.table is None:  # table_obstacle has raised; this tells the type checker
        raise ExecutionError("no table")
    height = task.table.height_m
    moved = _named(task.object, height, "object")
    target = _named(task.target, height, "target") if task.target is not None else None
    others = []
    for i, detection in enumerate(task.scene):
        used = (task.object,) if task.target is None else (task.object, task.target)
        if any(_is_same(detection, other, options) for other in used):
            continue
        try:
            others.append(_named(detection, height, f"{detection.label or 'thing'}_{i}"))
        except ExecutionError as error:
            _LOG.warning("left out of the scene: %s", error)
    return SceneModel(moved, target, tuple(others), table, height)


def _named(detection: Detection, height: float, name: str) -> ObjectShape:
    shape = complete_detection(detection, height)
    return ObjectShape(
        name,
        shape.points,
        shape.visible,
        shape.centre,
        shape.yaw,
        shape.size,
        shape.bottom,
        shape.top,
        shape.axis,
        shape.rim,
    )


def _is_same(a: Detection, b: Detection, options: SceneMatchingOptions) -> bool:
    """Tell whether two detections are one object: the same name and the same place, or nearly the same place."""
    if a.geometry is None or b.geometry is None:
        return a.id == b.id
    apart = float(np.linalg.norm(a.geometry.centroid - b.geometry.centroid))
    return apart < options.same_place_m or (a.id == b.id and apart < options.same_name_m)
