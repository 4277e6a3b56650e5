# SPDX-License-Identifier: Apache-2.0
"""Which choice of a question a person names: by the words that only one choice has, or by its number."""

from __future__ import annotations

import re

from uncom_reasoner.dialogue.types import Question

ORDINALS = {
    "first": 0,
    "second": 1,
    "third": 2,
    "fourth": 3,
    "former": 0,
    "latter": -1,
    "last": -1,
}
FILLER_WORDS = frozenset(
    (
        "the",
        "a",
        "an",
        "one",
        "ones",
        "this",
        "that",
        "it",
        "is",
        "as",
        "of",
        "to",
        "or",
        "and",
        "please",
        "mean",
        "on",
        "in",
        "at",
        "from",
        "next",
        "thing",
        "object",
    )
)
# The person's "my" is the speaker's side, whatever the robot calls it.
SIDE_PRONOUNS = {
    "speaker": frozenset(("i", "my", "mine", "me")),
    "robot": frozenset(("you", "your", "yours", "robot", "robots")),
}
NEGATIONS = frozenset(("not", "no", "neither", "except", "without", "isn't"))


def find_choice(text: str, question: Question) -> str:
    """Return the id of the one candidate that a text names; "" if it names none or several, or says what is not meant.

    Whole words count: "there" in a text does not name "the other".
    """
    said = split_words(text)
    if question.part == "perspective":
        named = [side for side in question.candidate_ids if said & SIDE_PRONOUNS.get(side, frozenset())]
        return named[0] if len(named) == 1 else ""
    if said & NEGATIONS:
        return ""
    choices = [split_words(choice) - FILLER_WORDS for choice in question.choices]
    named = []
    for i, words in enumerate(choices):
        shared = frozenset().union(*(other for j, other in enumerate(choices) if j != i))
        if said & (words - shared):
            named.append(question.candidate_ids[i])
    if named:
        return named[0] if len(named) == 1 else ""
    numbers = {ORDINALS[word] for word in said if word in ORDINALS}
    extra = said - FILLER_WORDS - set(ORDINALS)
    if len(numbers) == 1 and not extra and -1 <= (number := numbers.pop()) < len(question.candidate_ids):
        return question.candidate_ids[number]
    return ""


def split_words(text: str) -> frozenset[str]:
    """Return the words of a text, in lower case."""
    return frozenset(re.findall(r"[a-z0-9']+", text.lower()))
