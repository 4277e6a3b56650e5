# SPDX-License-Identifier: Apache-2.0
"""What a language model may answer: JSON schemas of both steps, and the check of an answer against them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from uncom_language.exceptions import AnswerError
from uncom_language.llm.options import CHAT

_TIME = {"type": "number", "minimum": 0, "maximum": CHAT.max_time_s}


def _part(*, refined: bool) -> dict[str, Any]:
    properties: dict[str, Any] = {
        "text": {"type": "string", "minLength": 1, "maxLength": CHAT.max_part_characters},
        "timestamp": {"type": "array", "items": _TIME, "minItems": 2, "maxItems": 2},
    }
    if refined:
        properties["concrete"] = {"type": "boolean"}
    return {
        "anyOf": [
            {
                "type": "object",
                "properties": properties,
                "required": list(properties),
                "additionalProperties": False,
            },
            {"const": ""},
        ]
    }


def answer_schema(*, refined: bool) -> dict[str, Any]:
    """Return the schema of the first answer, or of the second, which tells what is concrete."""
    parts = {
        "object": _part(refined=refined),
        "action": _part(refined=False),
        "target": _part(refined=refined),
    }
    return {"type": "object", "properties": parts, "required": list(parts), "additionalProperties": False}


def validate_answer(text: str, *, refined: bool, words: str) -> dict[str, Any]:
    """Return an answer as data.

    Args:
        text: what the model wrote.
        refined: whether it is the second answer.
        words: what was said; parts must be made of these.

    Raises:
        AnswerError: no JSON, not of the schema, or with words that nobody said. The message tells the model why.
    """
    try:
        data = json.loads(text)
    except ValueError as error:
        raise AnswerError(f"this is no JSON: {error}") from error
    if not isinstance(data, dict) or set(data) != {"object", "action", "target"}:
        raise AnswerError("the JSON object must have exactly the keys object, action and target")
    said = set(words.lower().split())
    for name, part in data.items():
        if part != "":
            _check_part(name, part, said, concrete=refined and name != "action")
    return data


def _check_part(name: str, part: Any, said: set[str], *, concrete: bool) -> None:
    keys = {"text", "timestamp"} | ({"concrete"} if concrete else set())
    if not isinstance(part, Mapping) or set(part) != keys:
        raise AnswerError(f"{name} must be empty or have exactly the keys {', '.join(sorted(keys))}")
    text, times = part["text"], part["timestamp"]
    if not isinstance(text, str) or not text.strip() or len(text) > CHAT.max_part_characters:
        raise AnswerError(f"the text of {name} must be the words that were said")
    strange = [word for word in text.lower().split() if word not in said]
    if strange:
        raise AnswerError(f"nobody said {strange[0]!r}, which is in {name}")
    pair = isinstance(times, list) and [isinstance(time, int | float) for time in times] == [True, True]
    if not pair or not 0 <= times[0] <= times[1]:
        raise AnswerError(f"the timestamp of {name} must be [start, finish] in seconds")
    if concrete and not isinstance(part["concrete"], bool):
        raise AnswerError(f"concrete of {name} must be true or false")
