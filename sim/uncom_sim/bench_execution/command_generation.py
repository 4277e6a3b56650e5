# SPDX-License-Identifier: Apache-2.0
"""The next command for one robot, drawn from where everything stands now, as somebody before the table would give it.

Things are brought to free places or beside one another, or taken up and put down by the command after that; what the
robot still holds is put down first. A place is free, within the area of the table that the robot works on, and
what is seen now, and the thing itself, is seen when it stands there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from uncom_common.primitive import Primitive

from uncom_sim.bench_execution.cases import Case
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.objects.footprint import outline
from uncom_sim.person.hand_placement import robot_viewpoint
from uncom_sim.types import Meaning, ObjectState, Point2, Scene, SceneObject
from uncom_sim.world.scene_variation import is_visible

# What stands so much nearer, farther or to either side of where things are put can be asked for too [m].
_AROUND_M = (0.05, 0.10, 0.07)
_CLEAR_M = (0.06, 0.05, 0.04, 0.03)  # between outlines, tried one after the other
_AWAY_M = 0.13  # least way that is worth a command
_TRIES = 300
_FALLEN_M = 0.05
_WANTED, _SHARES = ("area", "beside", "pick"), (0.7, 0.2, 0.1)
_BESIDE = {"left_of": (0.0, 1.0), "right_of": (0.0, -1.0), "in_front_of": (-1.0, 0.0), "behind": (1.0, 0.0)}


@dataclass(frozen=True, slots=True)
class WorkArea:
    """The area of the table where things are put: from and to [m] ahead of the robot, and to either side."""

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
    things: tuple[SceneObject, ...]
    clear_m: float
    area: WorkArea

    @cached_property
    def seen(self) -> frozenset[str]:
        """Ids of what is wholly in the robot's sight."""
        return _in_sight(replace(self.scene, objects=self.things))


def random_scene(kinds: Iterable[str], rng: np.random.Generator) -> Scene:
    """Return a scene with a thing of each kind, apart and in sight.

    Raises:
        SceneError: there is no space for so many.
    """
    things: tuple[SceneObject, ...] = ()
    for i, kind in enumerate(kinds):
        thing = SceneObject(f"o{i}", kind, natural_colour(kind), 0.0, 0.0, float(rng.uniform(-np.pi, np.pi)))
        place = _free_place(thing, _FreeSpace(Scene(things, "do it"), things, _CLEAR_M[0], WorkArea()), rng)
        if place is None:
            raise SceneError(f"found no room on the table for {thing.kind}")
        things = (*things, replace(thing, x=place[0], y=place[1]))
    return Scene(things, "do it")


def next_command(
    number: int,
    states: Iterable[ObjectState],
    scene: Scene,
    rng: np.random.Generator,
    held: str = "",
    area: WorkArea | None = None,
) -> Case:
    """Return a command; held is the id of what is in the robot's hand, if anything is; area is where things are put.

    Raises:
        SceneError: nothing is left within reach, or there is no free place for any of it.
    """
    area = area or WorkArea()
    now = tuple(_standing(state, scene) for state in states if state.position[2] > scene.table.height - _FALLEN_M)
    asked = [thing for thing in now if thing.id == held] if held else [thing for thing in now if _is_near(thing, area)]
    order = [asked[i] for i in rng.permutation(len(asked))]
    wanted = "area" if held else str(rng.choice(_WANTED, p=_SHARES))
    if wanted == "pick" and order:
        return Case(number, replace(scene, objects=now), Meaning(order[0].id, "none"), "pick", Primitive.PICK, None)
    for clear in _CLEAR_M:
        for thing in order:
            others = tuple(other for other in now if other.id != thing.id)
            space = _FreeSpace(replace(scene, objects=now), others, clear, area)
            case = _beside(number, thing, space, rng) if wanted == "beside" else None
            if case is not None:
                return case
            place = _free_place(thing, space, rng)
            if place is not None:
                return Case(number, space.scene, Meaning(thing.id, "area", None, place), "area", Primitive.PLACE, place)
    raise SceneError("found no thing within reach with a free place to go to")


def _standing(state: ObjectState, scene: Scene) -> SceneObject:
    pose = state.pose
    yaw = float(np.arctan2(pose[1, 0], pose[0, 0]))
    colour = scene.object(state.id).colour
    return SceneObject(state.id, state.kind, colour, float(state.position[0]), float(state.position[1]), yaw)


def _is_near(thing: SceneObject, area: WorkArea) -> bool:
    nearer, farther, aside = _AROUND_M
    return area.x[0] - nearer <= thing.x <= area.x[1] + farther and abs(thing.y) <= area.y + aside


def _beside(number: int, thing: SceneObject, space: _FreeSpace, rng: np.random.Generator) -> Case | None:
    """Return a command to put a thing beside one of the others, or None where there is no room."""
    for other in (space.things[i] for i in rng.permutation(len(space.things))):
        for relation in (str(r) for r in rng.permutation(list(_BESIDE))):
            dx, dy = _BESIDE[relation]
            for away in np.arange(0.08, 0.28, 0.01):
                place = other.x + float(away) * dx, other.y + float(away) * dy
                if _is_free(thing, place, space):
                    meaning = Meaning(thing.id, relation, other.id)
                    return Case(number, space.scene, meaning, relation, Primitive.PLACE, place)
    return None


def _free_place(thing: SceneObject, space: _FreeSpace, rng: np.random.Generator) -> Point2 | None:
    for _ in range(_TRIES):
        place = space.area.draw(rng)
        if _is_free(thing, place, space):
            return place
    return None


def _is_free(thing: SceneObject, place: Point2, space: _FreeSpace) -> bool:
    """Whether a thing can stand at a place, with room around it, where it is seen and hides nothing."""
    x, y = place
    if not space.area.has(x, y) or np.hypot(x - thing.x, y - thing.y) < _AWAY_M:
        return False
    moved = replace(thing, x=x, y=y)
    shape, table = outline(moved), space.scene.table
    if not shapely.box(table.x_min, table.y_min, table.x_max, table.y_max).buffer(-0.01).contains(shape):
        return False
    if any(shape.distance(outline(other)) < space.clear_m for other in space.things):
        return False
    return _in_sight(replace(space.scene, objects=(*space.things, moved))) >= {*space.seen, thing.id}


def _in_sight(scene: Scene) -> frozenset[str]:
    viewpoint = robot_viewpoint()
    return frozenset(thing.id for thing in scene.objects if is_visible(thing, scene, viewpoint))
