# SPDX-License-Identifier: Apache-2.0
"""Single commands for the execution benchmark: every kind of object, every relation, both arms; feasible as built.

Objects stand apart by more than a finger, wholly in the camera's picture and not hidden behind one another; what is to
be moved and where it is to go lie in the part of the table that one arm reaches; the place itself is free and in sight,
and what is asked for is not so already.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from uncom_common.primitive import Primitive

from uncom_sim.bench_execution.options import CASES, CaseOptions
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import KINDS, model, natural_colour
from uncom_sim.objects.footprint import outline
from uncom_sim.scoring.end_state import judge
from uncom_sim.types import DIRECTIONS, Meaning, ObjectState, Point2, Scene, SceneObject
from uncom_sim.world.placement_check import check_placement
from uncom_sim.world.scene_variation import all_visible

RELATIONS = (
    "pick",
    "in",
    "on",
    "push",
    "stack",
    "area",
    "next_to",
    "give",
    "left_of",
    "right_of",
    "pour",
    "in_front_of",
    "behind",
    "point",
    "between",
)
_WITHOUT_TARGET = ("pick", "area", "push", "give", "point")
_PUSHABLE = ("plate", "bowl", "frying pan", "box", "cereal box", "can", "mug", "cup")
_POURABLE: dict[str, tuple[str, ...]] = {
    "bowl": ("mug", "cup", "bottle", "can"),
    "frying pan": ("mug", "cup", "bottle", "can"),
    "mug": ("bottle", "can"),
}
_RARE_ACTS = ("push", "give", "pour", "point")
_PRIMITIVES = {"in": Primitive.PUT_IN, "on": Primitive.PUT_ON}
_SMALL_KINDS = ("banana", "apple", "lemon", "orange", "pear", "spoon")
_CONTAINABLE: dict[str, tuple[str, ...]] = {
    "bowl": _SMALL_KINDS,
    "frying pan": _SMALL_KINDS,
}
_SUPPORTABLE: dict[str, tuple[str, ...]] = {
    "box": ("apple", "pear", "mug", "cup", "can", "bottle", "box"),
    "plate": (*_SMALL_KINDS, "mug", "cup", "can", "bottle"),
}
_STACKABLE: dict[str, tuple[str, ...]] = {
    "plate": ("bowl", "mug", "cup"),
    "box": ("box", "can", "cup", "mug", "bottle"),
}


@dataclass(frozen=True, slots=True)
class Case:
    """One command: scene, what is meant (for scoring), the primitive, and the place on the table if there is one."""

    number: int
    scene: Scene
    meaning: Meaning
    relation: str
    primitive: Primitive
    place: Point2 | None

    @property
    def kind(self) -> str:
        """Kind of the object to move."""
        return self.scene.object(self.meaning.object).kind


def make_case(number: int, seed: int = 0, *, options: CaseOptions = CASES) -> Case:
    """Return case `number` of a seed: kinds and relations take turns, everything else is drawn.

    Raises:
        SceneError: no arrangement was found.
    """
    rng = np.random.default_rng([seed, number, 11])
    kind = KINDS[number % len(KINDS)]
    side = 1.0 if (number + number // len(KINDS)) % 2 else -1.0
    for relation in asked_relations(number, options=options):
        for clutter in range(number * 7 % 5, -1, -1):  # fewer where so many find no room
            for _ in range(options.attempts):
                case = _draw_case(number, kind, relation, side, clutter, rng, options=options)
                if case is not None:
                    return case
    raise SceneError(f"found no arrangement for a {kind} in case {number} of seed {seed}")


def asked_relations(number: int, *, options: CaseOptions = CASES) -> list[str]:
    """Return what can be asked for the kind of a case: first what it was not asked for yet, and others the least."""
    uses: Counter[str] = Counter()
    asked: set[tuple[str, str]] = set()
    ordered: list[str] = []
    for n in range(number + 1):
        kind = KINDS[n % len(KINDS)]

        def worth(relation: str, kind: str = kind, n: int = n) -> tuple[bool, float, int]:
            share = uses[relation] * (options.rare_act_weight if relation in _RARE_ACTS else 1.0)
            return (kind, relation) in asked, share, (RELATIONS.index(relation) - n) % len(RELATIONS)

        ordered = sorted((r for r in RELATIONS if _targets(kind, r) != ()), key=worth)
        uses[ordered[0]] += 1
        asked.add((kind, ordered[0]))
    return ordered


def _targets(kind: str, relation: str) -> tuple[str, ...] | None:
    """Return the kinds that can be the target, () if there is none, None if no target is needed."""
    if relation in ("pick", "give") and kind == "plate":  # too flat and heavy for the edge to be held; it is pushed
        return ()
    if relation == "push" and kind not in _PUSHABLE:
        return ()
    if relation in _WITHOUT_TARGET:
        return None
    table = {"in": _CONTAINABLE, "on": _SUPPORTABLE, "stack": _STACKABLE, "pour": _POURABLE}.get(relation)
    if table is not None:
        return tuple(target for target, objects in table.items() if kind in objects)
    if relation == "between" and kind not in (*_SMALL_KINDS, "can", "mug", "cup", "bottle"):
        return ()
    return tuple(k for k in ("mug", "bowl", "box", "apple", "can", "plate") if k != kind)


def _draw_case(
    number: int,
    kind: str,
    relation: str,
    side: float,
    others: int,
    rng: np.random.Generator,
    *,
    options: CaseOptions = CASES,
) -> Case | None:
    targets = _targets(kind, relation)
    chosen = [str(rng.choice(targets))] if targets else []
    if relation == "between":
        chosen.append(str(rng.choice([t for t in targets or () if t != chosen[0]])))
    clutter = [str(k) for k in rng.choice(KINDS, others)]
    objects = []
    for i, name in enumerate((kind, *chosen, *clutter)):
        near = i <= len(chosen)
        x = float(rng.uniform(*options.near_x_m)) if near else float(rng.uniform(0.5, 0.85))
        y = float(side * rng.uniform(-0.08, options.near_y_m)) if near else float(rng.uniform(-0.42, 0.42))
        objects.append(SceneObject(f"o{i}", name, natural_colour(name), x, y, float(rng.uniform(-np.pi, np.pi))))
    scene = Scene(tuple(objects), "do it")
    place = _target_place(scene, relation, len(chosen), side, rng, options=options)
    if place is False or not _is_valid(scene, options=options):
        return None
    if isinstance(place, tuple) and not _is_free(place, scene, relation, options=options):
        return None
    meaning = _meaning(scene, relation, place if isinstance(place, tuple) else None)
    if relation in DIRECTIONS or relation == "next_to":
        states = initial_states(scene)
        if judge(states, states, meaning, scene.table).success:
            return None
    return Case(
        number, scene, meaning, relation, _primitive(relation, place), place if isinstance(place, tuple) else None
    )


def _primitive(relation: str, place: Point2 | bool | None) -> Primitive:
    """Return the primitive that carries out a relation; what has no name of its own is placed."""
    if relation in _PRIMITIVES:
        return _PRIMITIVES[relation]
    return Primitive.PLACE if isinstance(place, tuple) and relation != "push" else Primitive(relation)


def _meaning(scene: Scene, relation: str, place: Point2 | None) -> Meaning:
    """Return where the object has to be at the end."""
    obj = scene.object("o0")
    if relation in ("area", "between", "push"):
        return Meaning("o0", "area", None, place)
    if relation in ("pick", "give"):
        return Meaning("o0", "none")
    if relation in ("pour", "point"):  # where it was
        return Meaning("o0", "area", "o1" if relation == "pour" else None, (obj.x, obj.y))
    return Meaning("o0", "on" if relation == "stack" else relation, "o1")


def initial_states(scene: Scene) -> tuple[ObjectState, ...]:
    """Return where everything of a scene stands before anything has moved."""
    states = []
    for obj in scene.objects:
        shape, pose = model(obj.kind, obj.colour), np.eye(4)
        cos, sin = np.cos(obj.yaw), np.sin(obj.yaw)
        pose[:2, :2] = [[cos, -sin], [sin, cos]]
        pose[:3, 3] = obj.x, obj.y, scene.table.height - shape.bounds[0, 2]
        states.append(ObjectState(obj.id, obj.kind, obj.colour, pose, shape.size))
    return tuple(states)


def _target_place(
    scene: Scene, relation: str, targets: int, side: float, rng: np.random.Generator, *, options: CaseOptions = CASES
) -> Point2 | bool:
    """Return where on the table the object is to go, True if on or in the target, False if there is no such place."""
    if relation in ("pick", "in", "on", "stack", "give", "pour", "point"):
        return True
    if relation in ("area", "push"):
        x, y = float(rng.uniform(*options.near_x_m)), float(side * rng.uniform(-0.05, options.near_y_m))
    elif relation == "between":
        a, b = scene.object("o1"), scene.object("o2")
        x, y = 0.5 * (a.x + b.x), 0.5 * (a.y + b.y)
        if np.hypot(a.x - b.x, a.y - b.y) > options.between_m:
            return False
    else:
        angle = float(rng.uniform(-np.pi, np.pi))
        dx, dy = DIRECTIONS.get(relation, (float(np.cos(angle)), float(np.sin(angle))))
        anchor = scene.object("o1")
        away = _distance_beside(scene.object("o0"), anchor, (dx, dy), options=options)
        x, y = anchor.x + away * dx, anchor.y + away * dy
    inside = (
        options.near_x_m[0] - 0.02 <= x <= options.near_x_m[1] + 0.03
        and -options.across_m <= side * y <= options.near_y_m + 0.04
    )
    return (x, y) if inside and targets >= 0 else False


def _distance_beside(
    obj: SceneObject, anchor: SceneObject, direction: Point2, *, options: CaseOptions = CASES
) -> float:
    """Return how far from the anchor, in a direction, an object stands with a hand's breadth between them [m]."""
    still = outline(anchor)
    for away in np.arange(0.06, 0.5, 0.01):
        x, y = anchor.x + away * direction[0], anchor.y + away * direction[1]
        if outline(replace(obj, x=x, y=y)).distance(still) > options.beside_gap_m:
            return float(away)
    return 0.5


def _is_valid(scene: Scene, *, options: CaseOptions = CASES) -> bool:
    """Whether everything stands, apart, on the table, and is seen."""
    try:
        check_placement(scene.objects, scene.table)
    except SceneError:
        return False
    outlines = [outline(obj) for obj in scene.objects]
    table = scene.table
    top = shapely.box(table.x_min, table.y_min, table.x_max, table.y_max).buffer(-0.01)
    if not all(top.contains(shape) for shape in outlines):
        return False
    if any(a.distance(b) < options.gap_m for a, b in combinations(outlines, 2)):
        return False
    return all_visible(scene)


def _is_free(place: Point2, scene: Scene, relation: str, *, options: CaseOptions = CASES) -> bool:
    """Whether the object, turned as it is now, has room at a place away from where it is now."""
    obj = scene.object("o0")
    x, y = place
    room = outline(replace(obj, x=x, y=y)).buffer(0.02 if relation == "between" else 0.04)
    others = [outline(other) for other in scene.objects if other.id != "o0"]
    if any(room.intersects(shape) for shape in others):
        return False
    rest = (other for other in scene.objects if other.id != "o0")
    if not all_visible(replace(scene, objects=(replace(obj, x=x, y=y), *rest))):
        return False  # the robot looks again afterwards
    table = scene.table
    if not shapely.box(table.x_min, table.y_min, table.x_max, table.y_max).contains(room):
        return False
    if (obj.kind == "plate" or relation == "push") and not _can_be_pushed(obj, place, others, options=options):
        return False
    return bool(np.hypot(place[0] - obj.x, place[1] - obj.y) > options.least_move_m)


def _can_be_pushed(
    obj: SceneObject, place: Point2, others: list[shapely.Polygon], *, options: CaseOptions = CASES
) -> bool:
    """Whether the way there, and that of the hand behind the object, is free."""
    here, there = np.array([obj.x, obj.y]), np.array(place)
    length = float(np.linalg.norm(there - here))
    ahead = (there - here) / max(length, 1e-6)
    hand = here - 0.18 * ahead
    way = shapely.LineString([here, there]).buffer(0.14).union(shapely.Point(*hand).buffer(0.08))
    low, high = options.push_x_m
    reachable = low <= hand[0] <= high and abs(hand[1]) < options.push_y_m
    return reachable and length < options.longest_push_m and not any(way.intersects(shape) for shape in others)
