# SPDX-License-Identifier: Apache-2.0
"""Phrases as queries for an open-vocabulary detector: lower case, one full stop, no word of place."""

from __future__ import annotations

#: A phrase ends before these: detectors do not know where "left of" is, and look for both things.
_PLACES = (
    "to the left of",
    "to the right of",
    "left of",
    "right of",
    "on the left",
    "on the right",
    "in front of",
    "next to",
    "close to",
    "on top of",
    "between",
    "behind",
    "beside",
    "near",
    "above",
    "below",
    "under",
    "inside",
    "into",
    "onto",
    "in",
    "on",
    "at",
    "by",
)
_LEADING = frozenset(
    (
        "a",
        "an",
        "the",
        "this",
        "that",
        "these",
        "those",
        "my",
        "your",
        "his",
        "her",
        "its",
        "our",
        "their",
        "some",
        "any",
        "please",
        "left",
        "right",
        "leftmost",
        "rightmost",
        "nearest",
        "farthest",
        "closest",
        "front",
        "back",
        "other",
        "second",
        "third",
        "first",
    )
)
_ANYTHING = frozenset(("object", "objects", "thing", "things", "one", "ones", "something", "everything", "it", ""))


def query_of(phrase: str) -> str:
    """Return the query for a phrase: "The red mug next to it" -> "red mug."; "objects." for things of any kind."""
    words = "".join(c if c.isalnum() or c in "-'" else " " for c in phrase.lower()).split()
    text = f" {' '.join(words)} "
    ends = [at for place in _PLACES if (at := text.find(f" {place} ")) > 0]
    words = text[: min(ends, default=len(text))].split()
    words = [word for word in words if word not in _LEADING]
    if words and words[-1] in _ANYTHING and len(words) > 1:
        words[-1] = "object"
    if not words or " ".join(words) in _ANYTHING:
        return "objects."
    return " ".join(words) + "."
