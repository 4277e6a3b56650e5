# SPDX-License-Identifier: Apache-2.0
"""Labelled sentences and how a parse is compared with its label."""

from __future__ import annotations

from pathlib import Path

import yaml
from uncom_language.parser import parse_text, sentence_to_json

DATA = Path(__file__).parent / "data"
# Kinds whose label is something else than commands.
SPECIAL = ("acts", "refused", "incomplete", "fragment", "correction")


def load(name):
    """Return kind -> sentence -> label; every scalar is text."""
    return yaml.load((DATA / f"{name}.yaml").read_text(encoding="utf-8"), Loader=yaml.BaseLoader)


def summary(command):
    """Return a command of the JSON layout as its label is written: object, primitive, relation, target, reference."""
    parts = [command["object"], command["target"]]
    found = [part["text"] if part else "-" for part in parts]
    made = [found[0], command["action"]["primitive"], command["relation"], found[1]]
    return made + ([command["reference2"]["text"]] if command["reference2"] else [])


def short(command):
    """Return a fragment or correction as its label is written: the thing, or "@relation place"."""
    if command["object"]:
        return command["object"]["text"]
    return f"@{command['relation']} {command['target']['text'] if command['target'] else '-'}"


def is_right(kind, text, label, language="en"):
    """Whether a sentence is read as labelled."""
    parsed = sentence_to_json(text, parse_text(text, language))
    if kind == "acts":
        return (parsed["act"], parsed["commands"]) == (label, [])
    if kind == "refused":
        return (parsed["act"], parsed["commands"]) == ("refused", []) and label in parsed["reason"]
    if kind == "incomplete":
        return parsed["act"] == "incomplete" and parsed["reason"].startswith(f"the {label} is missing")
    if kind in ("fragment", "correction"):
        return parsed["act"] == kind and [short(command) for command in parsed["commands"]] == [label]
    expected = label if isinstance(label[0], list) else [label]
    return parsed["act"] == "command" and [summary(command) for command in parsed["commands"]] == expected
