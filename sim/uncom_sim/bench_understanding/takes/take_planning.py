# SPDX-License-Identifier: Apache-2.0
"""Plans takes of a scenario: sentence, objects, places and person, all drawn from one seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from uncom_common.primitive import Primitive

from uncom_sim.bench_understanding.takes.object_placement import arrange_objects, place_additional
from uncom_sim.bench_understanding.takes.options import TAKE_PLANNING, TakePlanningOptions
from uncom_sim.bench_understanding.takes.scenarios import scenarios
from uncom_sim.bench_understanding.takes.types import Cast, Conditions, Rivals, Scenario, TakePlan
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.person.voice import VOICES
from uncom_sim.types import HANDS, Meaning, PersonOptions, Scene, SceneObject

ACTIONS = {
    "put": (Primitive.PUT_IN, Primitive.PUT_ON, Primitive.PLACE),
    "stack": (Primitive.STACK, Primitive.PUT_ON),
    "pour": (Primitive.POUR,),
}
_COLOURS = {
    "mug": ("blue", "red", "white", "green", "yellow", "black", "purple"),
    "cup": ("white", "red", "blue", "green", "pink"),
    "bowl": ("green", "red", "blue", "white", "yellow", "purple"),
    "plate": ("white", "blue", "red", "green"),
    "bottle": ("green", "blue", "red", "white"),
    "can": ("red", "blue", "green", "yellow"),
    "cereal box": ("orange", "blue", "red", "yellow"),
    "apple": ("red", "green"),
    "pear": ("green", "yellow"),
}
_FRUIT = ("banana", "apple", "lemon", "orange", "pear")
_VESSELS = ("bowl", "plate", "mug", "cup", "frying pan")
_OTHER_KINDS = ("box", "cereal box", "bottle", "can", "spoon")
# Kinds that people call by each other's names; where one is named, the other would be a riddle.
_INTERCHANGEABLE_KINDS = ({"mug", "cup"}, {"box", "cereal box"}, {"spoon"})


@dataclass(frozen=True, slots=True)
class _UnplacedObject:
    """A kind and colour that has no place yet."""

    id: str
    kind: str
    colour: str


def plan_takes(
    seed: int,
    numbers: Sequence[int] = (),
    takes: int | None = None,
    *,
    take_planning_options: TakePlanningOptions = TAKE_PLANNING,
) -> tuple[TakePlan, ...]:
    """Plan takes: of all scenarios or those of some numbers, as many as the authors had, or so many in all.

    With `takes`, they are spread over the scenarios as evenly as their numbers allow.
    """
    chosen = [s for s in scenarios() if not numbers or s.id in numbers]
    wanted = [(s, index) for s in chosen for index in range(s.takes)]
    if takes is not None and takes < len(wanted):
        by_turns = sorted(wanted, key=lambda pair: (pair[1] / pair[0].takes, pair[0].id))
        wanted = sorted(by_turns[:takes], key=lambda pair: (pair[0].id, pair[1]))
    return tuple(plan_take(s, index, seed, take_planning_options=take_planning_options) for s, index in wanted)


def plan_take(
    scenario: Scenario, index: int, seed: int, *, take_planning_options: TakePlanningOptions = TAKE_PLANNING
) -> TakePlan:
    """Plan one take; it depends on nothing but the scenario, the number and the seed.

    Raises:
        SceneError: the objects of the scenario find no room.
    """
    rng = np.random.default_rng([seed, scenario.id, index, 11])
    relation = str(_first_or_drawn(tuple(scenario.relations), index, rng))
    cast = scenario.casts[index % len(scenario.casts)]
    person, manner = _draw_person(rng, take_planning_options)
    conditions = Conditions(
        light=round(float(rng.uniform(0.7, 1.12)), 3),
        camera_noise=round(float(rng.uniform(0.5, 2.0)), 3),
        exposure_s=round(float(rng.uniform(0.008, 0.033)), 4),
    )
    for _ in range(take_planning_options.attempts):
        unplaced = _draw_objects(scenario, cast, rng)
        placed = arrange_objects(unplaced, relation, scenario, rng)
        if placed is not None:
            objects, area = placed
            break
    else:
        raise SceneError(f"the things of scenario {scenario.id} find no room on the table; try another seed")
    say = _compose_sentence(scenario, cast, relation, index, {t.id: t for t in objects}, rng)
    place = None if area is None else (round(area[0], 4), round(area[1], 4))
    meaning = Meaning("object", relation, None if place is not None else "target", place)
    pointed = {"object": "object", "target": "target" if place is None else place}
    scene = Scene(
        objects=objects,
        say=say,
        point_object="object" if "object" in scenario.point else None,
        point_target=pointed["target"] if "target" in scenario.point else None,
        person=person,
        meaning=meaning,
        name=f"benchmark {scenario.id}",
        description=scenario.name,
    )
    world_seed = int(np.random.default_rng([seed, scenario.id, index, 12]).integers(1, 2**31))
    return TakePlan(scenario.id, index, seed, scene, ACTIONS[scenario.action], conditions, world_seed, manner)


def with_bystanders(plan: TakePlan, count: int) -> TakePlan | None:
    """Return a take with so many further objects of kinds that its words do not name; None without room for them."""
    rng = np.random.default_rng([plan.world_seed, 21])
    taken = {obj.kind for obj in plan.scene.objects}
    vague = not any(kind.split()[-1] in plan.scene.say for kind in _VESSELS)  # "this thing" may be any vessel
    pool = [
        k for k in (*_FRUIT, *_VESSELS, *_OTHER_KINDS) if not _share_a_name(k, taken) and not (vague and k in _VESSELS)
    ]
    if "fruit" in plan.scene.say:
        pool = [k for k in pool if k not in _FRUIT]
    kinds = [str(kind) for kind in rng.permutation(pool)[:count]]
    if len(kinds) < count:
        return None
    more = tuple(SceneObject(f"bystander_{i + 1}", k, _draw_colour(k, rng), 0.0, 0.0) for i, k in enumerate(kinds))
    placed = place_additional(plan.scene, more, rng)
    return None if placed is None else replace(plan, scene=replace(plan.scene, objects=placed))


def _first_or_drawn(options: Sequence[str], index: int, rng: np.random.Generator) -> str:
    """Take the first option for the first take (the paper's own words), any for the others."""
    drawn = options[int(rng.integers(len(options)))]
    return options[0] if index == 0 else drawn


def _compose_sentence(
    scenario: Scenario,
    cast: Cast,
    relation: str,
    index: int,
    objects: dict[str, SceneObject],
    rng: np.random.Generator,
) -> str:
    frame = _first_or_drawn(scenario.frames, index, rng)
    words = {
        "o": cast.object_word,
        "t": cast.target_word,
        "oc": objects["object"].colour,
        "tc": objects["target"].colour if "target" in objects else "",
    }
    object_phrase = _first_or_drawn(scenario.object_phrases, index, rng).format(**words)
    target_phrase = _first_or_drawn(scenario.target_phrases, index, rng).format(**words)
    relation_words = _first_or_drawn(scenario.relations[relation], index, rng)
    return " ".join(frame.format(O=object_phrase, T=target_phrase, R=relation_words).split())


def _draw_objects(scenario: Scenario, cast: Cast, rng: np.random.Generator) -> tuple[SceneObject, ...]:
    """Draw kinds and colours; places are still to be found."""
    main = _UnplacedObject("object", cast.object, _draw_colour(cast.object, rng))
    unplaced = [main]
    if cast.target:
        unplaced.append(_UnplacedObject("target", cast.target, _draw_colour(cast.target, rng)))
    named = {cast.object, cast.target} - {""}
    by_colour = "{oc}" in " ".join(scenario.object_phrases)
    unplaced += _draw_rivals("object_rival", scenario.rivals, main, named, unplaced, rng, by_colour=by_colour)
    goal = unplaced[1] if cast.target else main
    unplaced += _draw_rivals("target_rival", scenario.target_rivals, goal, named, unplaced, rng, by_colour=by_colour)
    if scenario.clutter is not None:
        taken = named | {t.kind for t in unplaced}
        pool = [k for k in (*_FRUIT, *_VESSELS, *_OTHER_KINDS) if not _share_a_name(k, taken)]
        if "fruit" in scenario.object_phrases[0]:
            pool = [k for k in pool if k not in _FRUIT]
        if scenario.target == "deixis":  # "this thing" into which one can put something
            pool = [k for k in pool if k not in _VESSELS]
        count = min(int(rng.integers(scenario.clutter[0], scenario.clutter[1] + 1)), len(pool))
        for number, kind in enumerate(rng.choice(pool, count, replace=False)):
            unplaced.append(_UnplacedObject(f"clutter_{number + 1}", str(kind), _draw_colour(str(kind), rng)))
    return tuple(SceneObject(t.id, t.kind, t.colour, 0.0, 0.0) for t in unplaced)


def _draw_rivals(
    stem: str,
    rivals: Rivals | None,
    of: _UnplacedObject,
    named: set[str],
    present: Sequence[_UnplacedObject],
    rng: np.random.Generator,
    *,
    by_colour: bool,
) -> list[_UnplacedObject]:
    if rivals is None:
        return []
    made: list[_UnplacedObject] = []
    for number in range(int(rng.integers(rivals.fewest, rivals.most + 1))):
        taken = named | {t.kind for t in (*present, *made)}
        pools = {
            "same": (of.kind,),
            "fruit": tuple(k for k in _FRUIT if k not in taken),
            "vessel": tuple(k for k in _VESSELS if k != "cup" and not _share_a_name(k, taken)),
            "any": tuple(k for k in (*_FRUIT, *_OTHER_KINDS) if not _share_a_name(k, taken)),
        }
        kind = str(rng.choice(pools[rivals.kind]))
        colour = _draw_colour(kind, rng)
        if by_colour:
            used = {t.colour for t in (of, *made) if t.kind == kind}
            free = [c for c in _COLOURS.get(kind, ()) if c not in used]
            colour = str(rng.choice(free)) if free else colour
        made.append(_UnplacedObject(f"{stem}_{number + 1}", kind, colour))
    return made


def _share_a_name(kind: str, taken: set[str]) -> bool:
    return kind in taken or any(kind in group and group & taken for group in _INTERCHANGEABLE_KINDS)


def _draw_colour(kind: str, rng: np.random.Generator) -> str:
    choices = _COLOURS.get(kind)
    return natural_colour(kind) if choices is None else str(rng.choice(choices))


def _draw_person(rng: np.random.Generator, options: TakePlanningOptions = TAKE_PLANNING) -> tuple[PersonOptions, str]:
    """Draw a person and how they point: in time, early, late, or with an unsteady hand."""
    person = PersonOptions(
        hand=str(rng.choice(HANDS)),
        skin=round(float(rng.uniform(0.0, 1.0)), 3),
        size=round(float(rng.uniform(0.86, 1.14)), 3),
        voice=str(rng.choice(VOICES)),
        speed=round(float(rng.uniform(125.0, 172.0)), 1),
        pitch=round(float(rng.uniform(25.0, 75.0)), 1),
        lead=round(float(rng.uniform(0.08, 0.30)), 3),
        lag=round(float(rng.uniform(0.08, 0.30)), 3),
        noise=round(float(np.exp(rng.uniform(np.log(0.002), np.log(0.05)))), 4),
        reverb=round(float(max(0.0, rng.uniform(-0.3, 0.15))), 3),
        waver=0.0,
    )
    draw, amount = rng.random(2)
    if draw < options.early_below:
        return replace(person, lead=round(float(0.4 + 0.4 * amount), 3)), "early"
    if draw < options.late_below:
        return replace(person, lead=round(float(-0.10 - 0.25 * amount), 3)), "late"
    if draw < options.wavering_below:
        return replace(person, waver=round(float(0.006 + 0.012 * amount), 4)), "wavering"
    return person, "plain"
