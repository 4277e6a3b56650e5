# SPDX-License-Identifier: Apache-2.0
"""What the robot says of a decision, in plain words."""

from __future__ import annotations

from uncom_common.primitive import Primitive
from uncom_language.types import Act, Command, Reference, Relation
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import is_bare, is_place_word
from uncom_reasoner.posterior.posterior import describe_detection, dominant_colour
from uncom_reasoner.types import GroundedCommand, Status, TargetKind

RELATION_WORDS = {
    Relation.LEFT_OF: "to the left of",
    Relation.RIGHT_OF: "to the right of",
    Relation.IN_FRONT_OF: "in front of",
    Relation.BEHIND: "behind",
    Relation.NEXT_TO: "next to",
    Relation.NEAR: "near",
    Relation.BETWEEN: "between",
}


def repeat_reference(reference: Reference) -> str:
    """Return a reference as the robot would repeat it: "the red mug", "this"."""
    words = " ".join(w for w in reference.text.split() if w not in (reference.deictic, "other"))
    if is_bare(reference) and not reference.modifiers and not reference.other:
        return reference.deictic or words or "it"
    determiner = "the other" if reference.other else "the"
    return f"{determiner} {words or 'one'}"


def pluralize(reference: Reference) -> str:
    """Return the name of several of a kind as the speaker said it: "red apples", "things"."""
    words = " ".join(w for w in reference.text.split() if w not in (reference.deictic, "other"))
    if not words or is_bare(reference):
        return "things"
    return words if words.endswith("s") else f"{words}s"


def caption_reference(reference: Reference | None) -> str:
    """Return a reference as the paper's caption has it (words of the speaker), "" without one."""
    if reference is None:
        return ""
    said = reference.text.split()
    before = [reference.deictic] if reference.deictic not in said else []
    before += ["other"] if reference.other and "other" not in said else []
    return " ".join(word for word in (*before, *said) if word)


def caption_target(command: Command) -> str:
    """Return the target with its relation: "left of the box", "bowl"."""
    words = caption_reference(command.target)
    relation = RELATION_WORDS.get(command.relation, "")
    second = f" and {caption_reference(command.reference2)}" if command.reference2 is not None else ""
    return f"{relation} {words}{second}".strip()


def compose_sentence(command: Command, grounded: GroundedCommand) -> str:
    """Return what the robot says: what it understood, or why it could not."""
    if grounded.status is not Status.GROUNDED:
        return grounded.reason
    moved = f"the {_name_detection(command.object, grounded.object)}" if grounded.object is not None else "it"
    place = _describe_place(command, grounded)
    if not place:
        return f"I take {moved}."
    if command.primitive is Primitive.POUR:
        return f"I pour from {moved} {place.replace('in ', 'into ', 1)}."
    return f"I take {moved} and put {'them' if grounded.parts > 1 else 'it'} {place}."


def compose_proposal(command: Command, grounded: GroundedCommand) -> str:
    """Return the question whether to do it (paper, section III-J): "Shall I take the lemon and put it in the bowl?"."""
    words = compose_sentence(command, grounded).removeprefix("I ").removesuffix(".")
    more = f" There are {grounded.parts} of them." if grounded.parts > 1 else ""
    return f"Shall I {words}?{more}"


def _name_detection(reference: Reference | None, detection: Detection) -> str:
    """Return the speaker's own noun where there is one, with the colour where a finger chose among several."""
    if reference is None or is_bare(reference) or is_place_word(reference):
        return describe_detection(detection)
    words = " ".join(w for w in reference.text.split() if w not in (reference.deictic, "other"))
    colour = dominant_colour(detection) if reference.deictic or reference.other else ""
    return words if not colour or colour in words.split() else f"{colour} {words}"


def _describe_place(command: Command, grounded: GroundedCommand) -> str:
    target = grounded.target
    if target.kind is TargetKind.NONE:
        return ""
    if target.kind is TargetKind.OBJECT and target.detection is not None:
        preposition = "in" if grounded.primitive in (Primitive.PUT_IN, Primitive.POUR) else "on"
        return f"{preposition} the {_name_detection(command.target, target.detection)}"
    if command.relation in RELATION_WORDS and command.target is not None:
        second = f" and {repeat_reference(command.reference2)}" if command.reference2 is not None else ""
        return f"{RELATION_WORDS[command.relation]} {repeat_reference(command.target)}{second}"
    if command.target is not None and not is_place_word(command.target) and not is_bare(command.target):
        return f"on {repeat_reference(command.target)}"
    return "there, where you point"


def compose_refusal(command: Command) -> str:
    """Return what to say to an utterance that is no complete command."""
    if command.act is Act.INCOMPLETE:
        return command.reason or "Something is missing in what I understood. Please say it again."
    return command.reason or "I did not understand a command. Tell me what to take and where to put it."
