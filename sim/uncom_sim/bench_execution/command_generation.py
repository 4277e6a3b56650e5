# SPDX-License-Identifier: Apache-2.0
"""The next command for one robot, drawn from where everything stands now, as somebody before the table would give it.

Objects are brought to free places or beside one another, or taken up and put down by the command after that; what the
robot still holds is put down first. A place is free, within the area of the table that the robot works on, and
what is seen now, and the object itself, is seen when it stands there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from uncom_common.primitive import Primitive

from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.options import COMMANDS, CommandOptions
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.objects.footprint import outline
from uncom_sim.person.hand_placement import robot_viewpoint
from uncom_sim.types import DIRECTIONS, Meaning, ObjectState, Point2, Scene, SceneObject
from uncom_sim.world.scene_variation import is_visible

_WANTED = ("area", "beside", "pick")


@dataclass(frozen=True, slots=True)
class WorkArea:
    """The area of the table where objects are put: from and to [m] ahead of the robot, and to either side."""

    x: Point2 = (0.50, 0.70)
    y: float = 0.36

    def has(self, x: float, y: float) -> bool:
        """Tell whether a place is in it."""
        return self.x[0] <= x <= self.x[1] and abs(y) <= self.y

    def draw(self, rng: np.random.Generator) -> Point2:
        """Return a place in it."""
        return float(rng.uniform(*self.x)), float(rng.uniform(-self.y, self.y))


@dataclass(frozen=True)
class _FreeSpace:
    """What stands on the table, by how much all that is to stay apart [m], and where there are places."""

    scene: Scene
    objects: tuple[SceneObject, ...]
    clear_m: float
    area: WorkArea

    @cached_property
    def seen(self) -> frozenset[str]:
        """Ids of what is wholly in the robot's sight."""
        return _in_sight(replace(self.scene, objects=self.objects))


def random_scene(kinds: Iterable[str], rng: np.random.Generator, *, options: CommandOptions = COMMANDS) -> Scene:
    """Return a scene with an object of each kind, apart and in sight.

    Raises:
        SceneError: there is no space for so many.
    """
    objects: tuple[SceneObject, ...] = ()
    for i, kind in enumerate(kinds):
        obj = SceneObject(f"o{i}", kind, natural_colour(kind), 0.0, 0.0, float(rng.uniform(-np.pi, np.pi)))
        place = _free_place(
            obj, _FreeSpace(Scene(objects, "do it"), objects, options.clearances_m[0], WorkArea()), rng, options=options
        )
        if place is None:
            raise SceneError(f"found no room on the table for {obj.kind}")
        objects = (*objects, replace(obj, x=place[0], y=place[1]))
    return Scene(objects, "do it")


def next_command(
    number: int,
    states: Iterable[ObjectState],
    scene: Scene,
    rng: np.random.Generator,
    held: str = "",
    area: WorkArea | None = None,
    *,
    options: CommandOptions = COMMANDS,
) -> Case:
    """Return a command; held is the id of what is in the robot's hand, if anything is; area is where objects are put.

    Raises:
        SceneError: nothing is left within reach, or there is no free place for any of it.
    """
    area = area or WorkArea()
    now = tuple(
        _scene_object(state, scene) for state in states if state.position[2] > scene.table.height - options.fallen_m
    )
    asked = (
        [obj for obj in now if obj.id == held] if held else [obj for obj in now if _is_near(obj, area, options=options)]
    )
    order = [asked[i] for i in rng.permutation(len(asked))]
    wanted = "area" if held else str(rng.choice(_WANTED, p=options.shares))
    if wanted == "pick" and order:
        return Case(number, replace(scene, objects=now), Meaning(order[0].id, "none"), "pick", Primitive.PICK, None)
    for clear in options.clearances_m:
        for obj in order:
            others = tuple(other for other in now if other.id != obj.id)
            space = _FreeSpace(replace(scene, objects=now), others, clear, area)
            case = _beside(number, obj, space, rng, options=options) if wanted == "beside" else None
            if case is not None:
                return case
            place = _free_place(obj, space, rng, options=options)
            if place is not None:
                return Case(number, space.scene, Meaning(obj.id, "area", None, place), "area", Primitive.PLACE, place)
    raise SceneError("found no thing within reach with a free place to go to")


def _scene_object(state: ObjectState, scene: Scene) -> SceneObject:
    pose = state.pose
    yaw = float(np.arctan2(pose[1, 0], pose[0, 0]))
    colour = scene.object(state.id).colour
    return SceneObject(state.id, state.kind, colour, float(state.position[0]), float(state.position[1]), yaw)


def _is_near(obj: SceneObject, area: WorkArea, *, options: CommandOptions = COMMANDS) -> bool:
    nearer, farther, aside = options.around_m
    return area.x[0] - nearer <= obj.x <= area.x[1] + farther and abs(obj.y) <= area.y + aside


def _beside(
    number: int, obj: SceneObject, space: _FreeSpace, rng: np.random.Generator, *, options: CommandOptions = COMMANDS
) -> Case | None:
    """Return a command to put an object beside one of the others, or None where there is no room."""
    for other in (space.objects[i] for i in rng.permutation(len(space.objects))):
        for relation in (str(r) for r in rng.permutation(list(DIRECTIONS))):
            dx, dy = DIRECTIONS[relation]
            for away in np.arange(0.08, 0.28, 0.01):
                place = other.x + float(away) * dx, other.y + float(away) * dy
                if _is_free(obj, place, space, options=options):
                    meaning = Meaning(obj.id, relation, other.id)
                    return Case(number, space.scene, meaning, relation, Primitive.PLACE, place)
    return None


def _free_place(
    obj: SceneObject, space: _FreeSpace, rng: np.random.Generator, *, options: CommandOptions = COMMANDS
) -> Point2 | None:
    for _ in range(options.tries):
        place = space.area.draw(rng)
        if _is_free(obj, place, space, options=options):
            return place
    return None


def _is_free(obj: SceneObject, place: Point2, space: _FreeSpace, *, options: CommandOptions = COMMANDS) -> bool:
    """Whether an object can stand at a place, with room around it, where it is seen and hides nothing."""
    x, y = place
    if not space.area.has(x, y) or np.hypot(x - obj.x, y - obj.y) < options.least_move_m:
        return False
    moved = replace(obj, x=x, y=y)
    shape, table = outline(moved), space.scene.table
    if not shapely.box(table.x_min, table.y_min, table.x_max, table.y_max).buffer(-0.01).contains(shape):
        return False
    if any(shape.distance(outline(other)) < space.clear_m for other in space.objects):
        return False
    return _in_sight(replace(space.scene, objects=(*space.objects, moved))) >= {*space.seen, obj.id}


def _in_sight(scene: Scene) -> frozenset[str]:
    viewpoint = robot_viewpoint()
    return frozenset(obj.id for obj in scene.objects if is_visible(obj, scene, viewpoint))
