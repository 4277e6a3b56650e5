# SPDX-License-Identifier: Apache-2.0
"""From what was seen of a run: progress, completion, summary, page and video."""

from __future__ import annotations

import json

import av
import numpy as np
import pytest
from uncom_bringup.bags.image_codec import encode_jpeg
from uncom_bringup.monitor import completion, run_record
from uncom_bringup.monitor.conversions import message_class, plain_from_msg
from uncom_bringup.monitor.run_record import Event, Frame, RunRecord
from uncom_bringup.report import execution_tree, progress, run_files, summary
from uncom_bringup.report.report_page import Outcome
from uncom_common.conversions import time_to_msg

WORDS = ["take", "the", "lemon", "and", "put", "it", "in", "this", "bowl"]


def message(kind, **fields):
    msg = message_class(f"uncom_interfaces/msg/{kind}")()
    for name, value in fields.items():
        target, *rest = name.split("__")
        holder = msg
        while rest:
            holder = getattr(holder, target)
            target, *rest = rest
        setattr(holder, target, value)
    return msg


def event(kind, msg, clock_s, stamp_s=0.0, **extra):
    return Event(kind, stamp_s or clock_s, clock_s, clock_s, {**plain_from_msg(msg, ("cloud", "mask")), **extra})


def transcript(text=WORDS, at=20.0):
    word = message_class("uncom_interfaces/msg/Word")
    words = [
        word(text=w, start=time_to_msg(10 + 0.3 * n), end=time_to_msg(10.25 + 0.3 * n), confidence=0.9)
        for n, w in enumerate(text)
    ]
    return event(run_record.TRANSCRIPT, message("Transcript", utterance_id="u1", text=" ".join(text), words=words), at)


def command(act=0, **fields):
    full = {
        "utterance_id": "u1",
        "count": 1,
        "act": act,
        "text": " ".join(WORDS),
        "action_text": "put",
        "primitive": run_record.PRIMITIVE_NAMES.index("put_in"),
        "relation": "in",
        "object__present": True,
        "object__text": "lemon",
        "target__present": True,
        "target__text": "bowl",
        **fields,
    }
    return event(run_record.COMMAND, message("Command", **full), 20.1)


def grounded(status=0, **fields):
    full = {"utterance_id": "u1", "status": status, "object_text": "lemon", "target_text": "bowl", **fields}
    full |= {
        "object__label": "lemon",
        "object__centroid__x": 0.6,
        "object__has_geometry": True,
        "target__object__has_geometry": True,
        "target__kind": 1,
        "target__object__label": "bowl",
    }
    return event(run_record.GROUNDED, message("GroundedCommand", backends=["hands=mediapipe 1"], **full), 20.6)


def stage(number, name, at, **fields):
    msg = message("ExecutionStatus", utterance_id="u1", stage=number, stage_name=name, **fields)
    return event(run_record.EXECUTION, msg, at)


def heard_until(seconds, state=0):
    return event(run_record.SPEECH_STATUS, message("SpeechStatus", state=state), seconds, seconds)


def whole_run():
    return [
        transcript(),
        command(),
        grounded(),
        stage(2, "PLANNING", 20.7),
        stage(4, "GRASPING", 23.0),
        stage(11, "DONE", 30.0),
        heard_until(25.0),
    ]


@pytest.mark.parametrize(
    ("left_out", "word"),
    [(6, "examined"), (1, "language_node"), (2, "reasoner_node"), (5, "execution_node"), (None, None)],
)
def test_what_is_still_to_come_is_named(left_out, word):
    events = whole_run()
    if left_out is not None:
        del events[left_out]
    waiting = completion.waiting_for(RunRecord(tuple(events)), 22.0)
    assert (waiting is None) == (word is None)
    assert word is None or word in waiting


def test_silence_is_complete_once_all_sound_was_examined():
    assert completion.waiting_for(RunRecord((heard_until(21.0),)), 22.0)
    assert completion.waiting_for(RunRecord((heard_until(22.5, state=2),)), 22.0)
    assert completion.waiting_for(RunRecord((heard_until(22.5),)), 22.0) is None
    assert completion.waiting_for(RunRecord((heard_until(22.5),)), None)


def test_a_refusal_waits_for_nobody():
    record = RunRecord((transcript(["hello", "there"]), command(act=1, reason="no verb"), heard_until(25.0)))
    assert completion.waiting_for(record, 22.0) is None
    assert summary.failure(record) == "no verb"


def test_the_second_command_of_an_utterance_is_waited_for():
    events = [transcript(), command(count=2), grounded(), stage(11, "DONE", 25.0), heard_until(25.0)]
    assert "language_node" in completion.waiting_for(RunRecord(tuple(events)), 22.0)


def test_failure_is_the_reason_of_the_last_stage_that_spoke():
    assert "heard no command" in summary.failure(RunRecord())
    refused = RunRecord((transcript(), command(), grounded(status=1, reason="no lemon")))
    assert summary.failure(refused) == "no lemon"
    dropped = RunRecord((transcript(), command(), grounded(), stage(12, "FAILED", 30.0, detail="dropped it")))
    assert summary.failure(dropped) == "dropped it"
    idle_again = RunRecord((*dropped.events, stage(0, "IDLE", 31.0)))
    assert summary.failure(idle_again) == "dropped it"
    assert summary.failure(RunRecord(tuple(whole_run()))) is None


def test_summary_tells_parts_times_and_back_ends():
    record = RunRecord(tuple(whole_run()))
    assert summary.heard(record) == " ".join(WORDS)
    understood = summary.understood(record)
    assert (understood["object"], understood["target"], understood["relation"]) == ("lemon", "bowl", "in")
    assert summary.timings(record)["stage_planning"] == pytest.approx(2.3)
    assert summary.timings(record)["stage_grasping"] == pytest.approx(7.0)
    assert summary.backends(record)["hands"] == "mediapipe 1"


def test_every_event_has_words_without_a_line_break():
    for one in whole_run():
        words = progress.line(one)
        assert words is None or "\n" not in words
    assert "lemon - put - in bowl" in progress.line(command())


EXPLANATION = {
    "command": {"spans": {"object": [10.3, 10.9], "target": [12.1, 12.7]}},
    "frames": {"scene": 9.0, "object": 10.9, "target": 12.7},
    "rays": {
        "target": {
            "span": [12.0, 12.8],
            "weight": 2.0,
            "present": True,
            "dwells": [
                {
                    "share": 1.0,
                    "hand": "right",
                    "sigma_rad": 0.1,
                    "stamps": [12.2, 12.4],
                    "stillness": [0.5, 1.0],
                    "tip_px": [1, 1],
                    "direction_px": [1, 0],
                    "tip": [0.8, 0.1, 0.9],
                    "direction": [-0.5, 0.1, -0.8],
                }
            ],
        }
    },
    "table": {"metric": True, "polygon": [[0.45, -0.5], [0.95, -0.5], [0.95, 0.5], [0.45, 0.5]]},
    "object": {
        "candidates": [
            {
                "id": "d1",
                "label": "<b>",
                "factors": {"words": -0.1, "ray": 0.4},
                "log": 0.3,
                "probability": 0.9,
                "chosen": True,
            },
            {
                "id": "none",
                "label": "none",
                "factors": {"words": -3.0},
                "log": -3.0,
                "probability": 0.1,
                "chosen": False,
            },
        ]
    },
    "target": {
        "candidates": [],
        "position": [0.7, 0.2, 0.72],
        "point": {"mean": [0.7, 0.2], "covariance": [[0.001, 0.0], [0.0, 0.001]]},
    },
    "cells": [
        {
            "id": "c1",
            "polygon": [[0.5, 0], [0.6, 0], [0.6, 0.1]],
            "centre": [0.55, 0.05],
            "occupied_by": "d1",
            "chosen": False,
        },
        {
            "id": "c2",
            "polygon": [[0.7, 0.1], [0.8, 0.1], [0.8, 0.3]],
            "centre": [0.75, 0.2],
            "occupied_by": "",
            "chosen": True,
        },
    ],
    "without": {"gesture": {"object": {"likeliest": "d2", "probability": 0.5}}},
}


def pictured_run():
    msg = message("Explanation", utterance_id="u1")
    events = (*whole_run(), event(run_record.EXPLANATION, msg, 20.6, json=EXPLANATION))
    rng = np.random.default_rng(1)
    picture = np.kron(rng.integers(0, 255, (24, 32, 3), np.uint8), np.ones((20, 20, 1), np.uint8))
    frames = tuple(Frame(9.0 + 0.125 * n, 0.0, encode_jpeg(np.roll(picture, 7 * n, axis=1))) for n in range(32))
    return RunRecord(events, camera=frames, overview=frames, annotated=(Frame(20.6, 20.6, frames[0].jpeg),))


def test_the_page_is_one_file_with_everything_in_it(tmp_path):
    made = run_files.write_run_files(
        tmp_path,
        "a <title>",
        pictured_run(),
        Outcome(True, "lemon_1 is in bowl_1"),
        {"wall_total": 12.0},
        heard=" ".join(WORDS),
        span_s=(9.0, 12.0),
    )
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert set(made) == {"command", "picture", "video", "report"}
    assert 'src="http' not in page
    assert "<link" not in page
    assert "a &lt;title&gt;" in page
    assert "&lt;b&gt;" in page
    assert "<td><b></td>" not in page
    for part in (
        "cell chosen",
        "cell occupied",
        "rayline",
        "data:image/jpeg;base64,",
        "would have been d2",
        "planning",
    ):
        assert part in page


def test_the_video_plays_at_the_pace_of_the_clock(tmp_path):
    run_files.write_run_files(tmp_path, "t", pictured_run(), Outcome(True, ""), {}, heard="", span_s=(9.0, 12.0))
    with av.open(str(tmp_path / "video.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert len(list(container.decode(stream))) == 24
        assert float(stream.average_rate) == 8.0


def test_an_empty_run_has_a_page_too(tmp_path):
    made = run_files.write_run_files(
        tmp_path, "t", RunRecord(), Outcome(False, "I heard nothing"), {}, heard="", span_s=(0, 1)
    )
    assert set(made) == {"command", "report"}
    assert "Nothing was heard" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_no_number_that_json_cannot_hold_gets_out():
    msg = message("GroundedCommand", object_probability=float("nan"), latency_s=float("inf"))
    plain = plain_from_msg(msg)
    assert plain["object_probability"] is None
    assert plain["latency_s"] is None


@pytest.mark.parametrize(
    ("kind", "names", "constants"),
    [
        ("Command", run_record.ACT_NAMES, "ACT_{}"),
        ("Command", run_record.PRIMITIVE_NAMES, "PRIMITIVE_{}"),
        ("GroundedCommand", run_record.STATUS_NAMES, "{}"),
    ],
)
def test_every_act_and_status_that_a_message_can_hold_has_its_name(kind, names, constants):
    numbers = {constants.format(name.upper()): number for number, name in enumerate(names)}
    told = message_class(f"uncom_interfaces/msg/{kind}")
    assert {name: getattr(told, name) for name in numbers} == numbers
    # The constants of a message class are the attributes of its metaclass in capitals.
    meant = [name for name in dir(type(told)) if name.isupper() and name.startswith(constants.format(""))]
    assert set(numbers) >= {name for name in meant if isinstance(getattr(told, name), int)}


def test_a_command_that_was_taken_back_has_a_page(tmp_path):
    status = message_class("uncom_interfaces/msg/GroundedCommand").CANCELLED
    grounded = message("GroundedCommand", status=status, reason="you said no")
    command = event(run_record.COMMAND, message("Command", text=" ".join(WORDS)), 20.1)
    run = RunRecord((transcript(), command, event(run_record.GROUNDED, grounded, 21.0)))
    run_files.write_run_files(tmp_path, "t", run, Outcome(False, "you said no"), {}, heard="", span_s=(9, 22))
    assert "you said no" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "cancelled" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_page_shows_the_tree_that_ran_with_why_its_branches_failed(tmp_path):
    far = {
        "name": "from here",
        "status": "FAILURE",
        "children": [{"name": "plan", "status": "FAILURE", "reason": "no"}],
    }
    tree = {"name": "execute", "status": "SUCCESS", "children": [far, {"name": "from nearer", "status": "SUCCESS"}]}
    events = whole_run()
    events[5] = stage(11, "DONE", 30.0, data_json=json.dumps({"tree": tree}))
    record = RunRecord(tuple(events))
    rows = execution_tree.rows_of({"tree": tree})
    assert [(row.depth, row.name) for row in rows] == [
        (0, "execute"),
        (1, "from here"),
        (2, "plan"),
        (1, "from nearer"),
    ]
    assert rows[2].reason == "no"
    assert not execution_tree.rows_of(execution_tree.data_of("no json"))
    run_files.write_run_files(tmp_path, "t", record, Outcome(True, "done"), {}, heard="", span_s=(9, 31))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "What was tried" in page
    assert "from nearer" in page
    assert "tree: " not in page
