# SPDX-License-Identifier: Apache-2.0
"""Two answers compared: the same is the same, and every change is named once, where it is."""

from __future__ import annotations

import copy
import json

import pytest
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.report.compare import Tolerance, compare, load_answer


def candidate(label, x, probability, chosen=False):
    box = [x, 10.0, x + 50.0, 60.0]
    return {"label": label, "box": box, "probability": probability, "factors": {}, "chosen": chosen}


def an_answer():
    words = ["take", "the", "lemon"]
    decision = {
        "status": "grounded",
        "reason": "",
        "object_probability": 0.8,
        "target_probability": 0.0,
        "chosen": {"object": [0.6, 0.1, 0.74], "target": None, "area": None},
        "object_candidates": [candidate("lemon", 100.0, 0.8, chosen=True), candidate("apple", 300.0, 0.2)],
        "target_candidates": [],
    }
    command = {
        "act": "command",
        "text": "take the lemon",
        "object": "lemon",
        "action": "take",
        "target": None,
        "relation": "none",
        "reason": "",
        "decisions": [decision],
    }
    spoken = [{"text": w, "start": 5.0 + 0.3 * n, "end": 5.2 + 0.3 * n} for n, w in enumerate(words)]
    return {"utterances": [{"text": " ".join(words), "words": spoken}], "commands": [command]}


def changed(edit):
    after = an_answer()
    edit(after, after["commands"][0], after["commands"][0]["decisions"][0])
    return [(found.kind, found.before, found.after) for found in compare(an_answer(), after)]


def test_the_same_is_the_same():
    assert compare(an_answer(), an_answer()) == []


def test_a_recording_that_begins_at_another_time_is_no_change():
    after = an_answer()
    for word in after["utterances"][0]["words"]:
        word["start"] += 90.0
        word["end"] += 90.0
    assert compare(an_answer(), after) == []


EDITS = {
    "a word": (
        lambda a, c, d: a["utterances"][0].update(text="take the melon"),
        [("words", "take the lemon", "take the melon"), ("words", "lemon", "melon")],
    ),
    "a part": (lambda a, c, d: c.update(relation="in"), [("command", "none", "in")]),
    "a command more": (lambda a, c, d: a["commands"].append(c), [("command", None, "take the lemon")]),
    "the status": (lambda a, c, d: d.update(status="failed"), [("decision", "grounded", "failed")]),
    "the choice": (
        lambda a, c, d: d["chosen"].update(object=[0.6, 0.2, 0.74]),
        [("choice", [0.6, 0.1, 0.74], [0.6, 0.2, 0.74])],
    ),
    "a probability": (
        lambda a, c, d: d["object_candidates"][1].update(probability=0.25),
        [("probability", 0.2, 0.25)],
    ),
    "a candidate less": (lambda a, c, d: d["object_candidates"].pop(), [("candidates", "apple", None)]),
    "a candidate more": (
        lambda a, c, d: d["object_candidates"].append(candidate("pear", 500.0, 0.0)),
        [("candidates", None, "pear")],
    ),
    "another name for the same box": (
        lambda a, c, d: d["object_candidates"][1].update(label="ball"),
        [("candidates", "apple", "ball")],
    ),
    "another order": (lambda a, c, d: d["object_candidates"].reverse(), []),
}


@pytest.mark.parametrize("name", EDITS)
def test_each_change_is_named(name):
    edit, expected = EDITS[name]
    assert changed(edit) == expected


def test_what_is_within_the_tolerance_is_no_change():
    after = copy.deepcopy(an_answer())
    after["commands"][0]["decisions"][0]["object_probability"] = 0.81
    assert compare(an_answer(), after, Tolerance(probability=0.02)) == []
    assert len(compare(an_answer(), after, Tolerance(probability=0.005))) == 1


def test_answers_are_read_from_folders_and_files_and_nothing_else(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "command.json").write_text(json.dumps({"answer": an_answer()}))
    assert load_answer(tmp_path / "run") == an_answer() == load_answer(tmp_path / "run" / "command.json")
    (tmp_path / "text").write_text("hello")
    (tmp_path / "list.json").write_text("[1]")
    for name, word in (("nothing", "does not exist"), ("text", "not JSON"), ("list.json", "no answer")):
        with pytest.raises(BadInputError, match=word):
            load_answer(tmp_path / name)
