# SPDX-License-Identifier: Apache-2.0
"""Read scenes (JSON files of the user) and scenarios (YAML of this package); refuse what cannot be simulated."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from uncom_sim.exceptions import SceneError
from uncom_sim.objects import catalogue
from uncom_sim.types import (
    HANDS,
    RELATIONS,
    SIDES,
    Meaning,
    PersonOptions,
    Point2,
    Scene,
    SceneObject,
    Table,
)
from uncom_sim.world.intended_meaning import with_say
from uncom_sim.world.options import TABLE_LIMITS
from uncom_sim.world.placement_check import check_placement
from uncom_sim.world.scene_variation import vary_scene

_SCENE_FIELDS = (
    "objects",
    "say",
    "point_object",
    "point_target",
    "table",
    "person",
    "meaning",
    "name",
    "description",
    "aliases",
)
_OBJECT_FIELDS = ("id", "kind", "colour", "x", "y", "yaw")
_PAIR = len(("x", "y"))
_PERSON_RANGES = {
    "skin": (0.0, 1.0),
    "size": (0.8, 1.2),
    "speed": (80.0, 260.0),
    "pitch": (0.0, 99.0),
    "lead": (-0.8, 2.0),
    "lag": (0.0, 2.0),
    "noise": (0.0, 3.0),
    "reverb": (0.0, 3.0),
    "waver": (0.0, 0.05),
}


def load_scene(path: str | Path, say: str | None = None) -> Scene:
    """Read a scene file (JSON); say takes the place of its sentence, see meaning.with_say.

    Raises:
        SceneError: the file is missing, is not JSON, or its scene cannot be used.
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as err:
        raise SceneError(f"there is no scene file {path}") from err
    except (OSError, UnicodeDecodeError) as err:
        raise SceneError(f"cannot read the scene file {path}: {getattr(err, 'strerror', None) or err}") from err
    except json.JSONDecodeError as err:
        raise SceneError(f"{path} is not JSON: {err.msg} in line {err.lineno}, column {err.colno}") from err
    try:
        return scene_from_dict(data, say=say, name=path.stem)
    except SceneError as err:
        raise SceneError(f"{path}: {err}") from err


def scenario_names() -> tuple[str, ...]:
    """Return the names of the shipped scenarios in the order of the paper."""
    return tuple(_scenarios())


def load_scenario(name: str, say: str | None = None, seed: int = 0) -> Scene:
    """Read a shipped scenario by its name or one of its aliases.

    Args:
        name: for example "iv" or "which_bowl".
        say: takes the place of its sentence, see meaning.with_say.
        seed: arranges the objects, see variation.vary_scene; 0 leaves them as they are written.

    Raises:
        SceneError: there is no such scenario.
    """
    known = _scenarios()
    wanted = name.strip().lower().replace("-", "_")
    for key, data in known.items():
        if wanted in (key, *data.get("aliases", ())):
            scene = vary_scene(scene_from_dict(data, name=key), seed)
            return scene if say is None else with_say(scene, say)
    listed = ", ".join(f"{key} ({', '.join(data.get('aliases', ()))})" for key, data in known.items())
    raise SceneError(f"there is no scenario {name!r}; scenarios are: {listed}")


def _scenarios() -> dict[str, dict[str, Any]]:
    folder = resources.files("uncom_sim") / "scenarios"
    files = sorted((f for f in folder.iterdir() if f.name.endswith(".yaml")), key=lambda f: f.name)
    read = [yaml.safe_load(f.read_text(encoding="utf-8")) for f in files]
    return {str(data["name"]): data for data in read}


def scene_from_dict(data: object, say: str | None = None, name: str = "scene") -> Scene:
    """Check a scene as it comes from JSON or YAML.

    Args:
        data: the mapping; its fields are those of Scene and SceneObject, the table's are x, y and height.
        say: a sentence that takes the place of the one in data, see meaning.with_say.
        name: what the scene is called when data does not say.

    Raises:
        SceneError: something is missing, unknown, overlapping or off the table; the text names it.
    """
    scene = _mapping(data, "a scene", _SCENE_FIELDS)
    table = _table(scene.get("table"))
    objects = _objects(scene.get("objects"))
    check_placement(objects, table)
    text = scene.get("say", say)
    if not isinstance(text, str):
        raise SceneError('"say" must be the sentence that the person speaks')
    ids = tuple(obj.id for obj in objects)
    made = Scene(
        objects=objects,
        say=" ".join(text.split()),
        point_object=_pointed(scene.get("point_object"), "point_object", ids, table),
        point_target=_pointed(scene.get("point_target"), "point_target", ids, table),
        table=table,
        person=_person(scene.get("person")),
        meaning=_meaning(scene.get("meaning"), ids),
        name=str(scene.get("name", name)),
        description=str(scene.get("description", "")),
    )
    return made if say is None else with_say(made, say)


def _objects(data: object) -> tuple[SceneObject, ...]:
    if not isinstance(data, Sequence) or isinstance(data, str):
        raise SceneError('"objects" must be a list of objects')
    objects: list[SceneObject] = []
    for i, entry in enumerate(data):
        obj = _object(entry, i, {o.id for o in objects})
        objects.append(obj)
    return tuple(objects)


def _object(data: object, index: int, taken: set[str]) -> SceneObject:
    entry = dict(_mapping(data, f"object {index + 1}", (*_OBJECT_FIELDS, "color")))
    label = f"object {entry['id']!r}" if "id" in entry else f"object {index + 1}"
    try:
        kind = catalogue.kind_named(str(entry.get("kind")))
        colour = entry.get("colour", entry.get("color"))
        named = catalogue.natural_colour(kind) if colour is None else catalogue.colour_named(str(colour))
        numbers = {key: _number(entry.get(key, 0.0 if key == "yaw" else None), key) for key in ("x", "y", "yaw")}
    except SceneError as err:
        raise SceneError(f"{label}: {err}") from err
    object_id = str(entry.get("id", _free_id(kind, taken)))
    if not object_id or object_id in taken:
        raise SceneError(f"{label}: another object has the same id")
    return SceneObject(object_id, kind, named, **numbers)


def _free_id(kind: str, taken: set[str]) -> str:
    stem, number = kind.replace(" ", "_"), 1
    while f"{stem}_{number}" in taken:
        number += 1
    return f"{stem}_{number}"


def _table(data: object) -> Table:
    if data is None:
        return Table()
    entry = _mapping(data, '"table"', ("x", "y", "height"))
    ranges: dict[str, float] = {}
    for axis in ("x", "y"):
        if axis in entry:
            pair = entry[axis]
            if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != _PAIR:
                raise SceneError(f'"table": "{axis}" must be two numbers, for example [0.45, 0.95]')
            low, high = (_number(value, f'table "{axis}"') for value in pair)
            if not TABLE_LIMITS.side_m[0] <= high - low <= TABLE_LIMITS.side_m[1]:
                raise SceneError(f'"table": "{axis}" must run from a lower to a higher number, 0.2 to 4 m long')
            ranges |= {f"{axis}_min": low, f"{axis}_max": high}
    if "height" in entry:
        ranges["height"] = _number(entry["height"], "table height")
        if not TABLE_LIMITS.height_m[0] <= ranges["height"] <= TABLE_LIMITS.height_m[1]:
            raise SceneError('"table": "height" must be between 0.3 and 1.1 m')
    table = replace(Table(), **ranges)
    if table.x_min < TABLE_LIMITS.nearest_x_m:
        raise SceneError('"table": "x" must start at 0.3 m or farther, or the robot stands in the table')
    return table


def _pointed(data: object, field: str, ids: Sequence[str], table: Table) -> str | Point2 | None:
    if data is None:
        return None
    if isinstance(data, str):
        if data not in ids:
            raise SceneError(f'"{field}": there is no object {data!r}; objects are: {", ".join(ids)}')
        return data
    if not isinstance(data, Sequence) or len(data) != _PAIR:
        raise SceneError(f'"{field}" must be the id of an object, a place [x, y], or null')
    x, y = (_number(value, field) for value in data)
    if not table.contains(x, y):
        raise SceneError(f'"{field}": the place ({x:g}, {y:g}) is not on the table')
    return (x, y)


def _person(data: object) -> PersonOptions:
    if data is None:
        return PersonOptions()
    entry = _mapping(data, '"person"', tuple(f.name for f in fields(PersonOptions)))
    for key, choices in (("side", SIDES), ("hand", HANDS)):
        if entry.get(key) is not None and entry[key] not in choices:
            raise SceneError(f'"person": "{key}" must be one of: {", ".join(choices)}')
    for key, (low, high) in _PERSON_RANGES.items():
        if entry.get(key) is not None and not low <= _number(entry[key], key) <= high:
            raise SceneError(f'"person": "{key}" must be between {low:g} and {high:g}')
    if entry.get("voice") is not None and not isinstance(entry["voice"], str):
        raise SceneError('"person": "voice" must be the name of an eSpeak voice, for example "en-us"')
    return PersonOptions(**entry)


def _meaning(data: object, ids: Sequence[str]) -> Meaning | None:
    if data is None:
        return None
    entry = _mapping(data, '"meaning"', ("object", "relation", "target", "area"))
    relation = entry.get("relation", "none")
    if relation not in RELATIONS:
        raise SceneError(f'"meaning": "relation" must be one of: {", ".join(RELATIONS)}')
    if entry.get("object") not in ids or entry.get("target") not in (None, *ids):
        raise SceneError(f'"meaning": "object" and "target" must be among: {", ".join(ids)}')
    area = entry.get("area")
    place = None if area is None else (_number(area[0], "area"), _number(area[1], "area"))
    return Meaning(str(entry["object"]), str(relation), entry.get("target"), place)


def _mapping(data: object, what: str, known: Sequence[str]) -> Mapping[str, Any]:
    if not isinstance(data, Mapping):
        raise SceneError(f"{what} must be an object with the fields: {', '.join(known)}")
    unknown = [str(key) for key in data if key not in known]
    if unknown:
        raise SceneError(f"{what} has an unknown field {unknown[0]!r}; fields are: {', '.join(known)}")
    return data


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise SceneError(
            f'"{what}" must be a number in metres, not {value!r}' if value is not None else f'"{what}" is missing'
        )
    return float(value)
