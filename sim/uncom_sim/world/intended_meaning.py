# SPDX-License-Identifier: Apache-2.0
"""What a person in a scene means, as far as words and pointing leave no doubt. For scoring only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from uncom_sim.objects.catalogue import model
from uncom_sim.objects.palette import COLOURS, SPELLINGS
from uncom_sim.person.phrases import find_phrases
from uncom_sim.types import Meaning, Point2, Scene

_THIS = frozenset(("this", "that", "it", "these", "those", "here", "there", "over", "one", "thing", "object", "item"))
_WORDS_OF_RELATIONS = (
    ("right_of", ("right",)),
    ("left_of", ("left",)),
    ("in_front_of", ("front", "before")),
    ("behind", ("behind",)),
    ("next_to", ("next", "beside", "besides", "near", "by", "at")),
    ("in", ("in", "into", "inside", "within")),
    ("on", ("on", "onto", "upon", "top", "over")),
)


def with_say(scene: Scene, say: str) -> Scene:
    """Return the scene with another sentence: the person points only at what the new words speak of.

    A gesture of the scene stays where the words are deictic or name the object it goes to; where they name another
    object, and only one there is, it goes to that object; else there is none.
    """
    words = say.split()
    phrases = find_phrases(words)
    spans = {"object": phrases.object, "target": phrases.target}
    pointed: dict[str, str | Point2 | None] = {"object": scene.point_object, "target": scene.point_target}
    for role, span in spans.items():
        pointed[role] = None if span is None else _still_pointed(scene, words[slice(*span)], pointed[role])
    changed = replace(
        scene, say=" ".join(words), point_object=pointed["object"], point_target=pointed["target"], meaning=None
    )
    return replace(changed, meaning=meaning_of(changed))


def meaning_of(scene: Scene) -> Meaning | None:
    """Return what is meant in a scene: what the scene says, or what words and pointing make plain, or None."""
    if scene.meaning is not None:
        return scene.meaning
    words = scene.say.lower().split()
    phrases = find_phrases(words)
    obj = None if phrases.object is None else _the_one(scene, words[slice(*phrases.object)], scene.point_object)
    if phrases.object is None or not isinstance(obj, str):
        return None
    if phrases.target is None:
        return Meaning(obj, "none")
    target = _the_one(scene, words[slice(*phrases.target)], scene.point_target)
    if isinstance(target, tuple):
        return Meaning(obj, "area", None, target)
    if target is None or target == obj:
        return None
    opening = model(scene.object(target).kind, scene.object(target).colour).opening
    natural = "in" if opening is not None else "next_to"
    return Meaning(obj, _relation(words[phrases.object[1] : phrases.target[0]]) or natural, target)


def named_objects(scene: Scene, phrase: Sequence[str]) -> tuple[str, ...]:
    """Return the ids of the objects that a phrase can name by kind and colour."""
    tokens = [word.lower().strip(".,!?;:\"'") for word in phrase]
    tokens = [SPELLINGS.get(token, token) for token in tokens]
    colours = [token for token in tokens if token in COLOURS]
    nouns = [token for token in tokens if token not in COLOURS]
    text = f" {' '.join(nouns)} "
    # "orange" is a colour and a fruit; as the last word it is the fruit.
    if tokens and tokens[-1] == "orange":
        text, colours = " orange ", colours[:-1]
    kinds = {obj.kind for obj in scene.objects if f" {obj.kind} " in text}
    if not kinds:
        kinds = {obj.kind for obj in scene.objects if f" {obj.kind.split()[-1]} " in text}
    return tuple(t.id for t in scene.objects if t.kind in kinds and all(c == t.colour for c in colours))


def _still_pointed(scene: Scene, phrase: Sequence[str], pointed: str | Point2 | None) -> str | Point2 | None:
    if pointed is None:
        return None
    candidates = named_objects(scene, phrase)
    if pointed in candidates:
        return pointed
    if candidates:
        return candidates[0] if len(candidates) == 1 else None
    return pointed if _THIS & {word.lower() for word in phrase} else None


def _the_one(scene: Scene, phrase: Sequence[str], pointed: str | Point2 | None) -> str | Point2 | None:
    candidates = named_objects(scene, phrase)
    if pointed is not None and (pointed in candidates or _THIS & {word.lower() for word in phrase}):
        return pointed
    return candidates[0] if len(candidates) == 1 else None


def _relation(between: Sequence[str]) -> str | None:
    # From the end, so that "take the cup on the left and put it in ..." is "in".
    for word in reversed(between):
        for relation, words in _WORDS_OF_RELATIONS:
            if word in words:
                return relation
    return None
