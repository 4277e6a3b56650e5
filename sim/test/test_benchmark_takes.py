# SPDX-License-Identifier: Apache-2.0
"""Takes as made: the same plan gives the same bytes, and what was said and shown is in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.bags.image_codec import decode_colour
from uncom_sim.bench_understanding.judging.ground_truth_scene import true_scene
from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.judging.verdict import judge
from uncom_sim.bench_understanding.reporting.checkpoint import RunCheckpoint
from uncom_sim.bench_understanding.reporting.miss_pictures import camera_pose
from uncom_sim.bench_understanding.ros.take_bag import write_bag
from uncom_sim.bench_understanding.takes.options import FILMING
from uncom_sim.bench_understanding.takes.recording import load_take, save_take
from uncom_sim.bench_understanding.takes.scenarios import scenario
from uncom_sim.bench_understanding.takes.take_planning import plan_take
from uncom_sim.bench_understanding.takes.take_synthesis import generator_version, make_take
from uncom_sim.exceptions import SimError
from uncom_sim.person.voice import speak

PLAN = plan_take(scenario(3), 0, 9)


@pytest.fixture(scope="module")
def take():
    return make_take(PLAN)


def test_the_same_plan_gives_the_same_bytes_whatever_was_made_before(take):
    speak("something else altogether", "en-us+f2", 171.0, 70.0)
    again = make_take(PLAN)
    assert np.array_equal(again.samples, take.samples)
    assert [f.jpeg for f in again.stored] == [f.jpeg for f in take.stored]
    assert [f.depth_png for f in again.stored] == [f.depth_png for f in take.stored]
    assert again.truth.words == take.truth.words
    assert again.links == take.links


def test_a_voice_says_the_same_words_in_the_same_way_again():
    speak.cache_clear()
    first = speak("put the mug here", "en-us+m3", 150.0, 40.0)
    speak("and now for something else", "en-us", 120.0, 60.0)
    speak.cache_clear()
    assert np.array_equal(speak("put the mug here", "en-us+m3", 150.0, 40.0).samples, first.samples)


def test_images_come_at_the_cameras_rate_until_a_while_after_the_last_word(take):
    stamps = np.array([frame.stamp_s for frame in take.stored])
    assert np.allclose(np.diff(stamps), 1.0 / FILMING.rate_hz)
    assert stamps[-1] > take.truth.words[-1].end_s + 0.8
    assert " ".join(w.text for w in take.truth.words) == PLAN.scene.say


def test_the_finger_is_pointed_while_the_words_are_said(take):
    spoken = {"object": (1, 3), "target": (6, 8)}  # "take [this mug] and put it on [this plate]"
    for pointing in take.truth.pointing:
        first, last = spoken[pointing.role]
        words = take.truth.words[first:last]
        assert pointing.start_s < words[-1].end_s < pointing.end_s + 0.5


def test_a_take_is_read_as_it_was_written(take, tmp_path):
    save_take(tmp_path / "a.take", take, PLAN.as_dict())
    read = load_take(tmp_path / "a.take")
    assert read.stored == take.stored
    assert read.links == take.links
    assert read.truth.pointing == take.truth.pointing
    assert np.array_equal(read.samples, take.samples)
    assert np.array_equal(read.truth.states[0].pose, take.truth.states[0].pose)
    (tmp_path / "a.take").write_bytes(b"no take")
    with pytest.raises(SimError, match="made again"):
        load_take(tmp_path / "a.take")


def test_a_bag_holds_the_very_bytes_of_the_take(take, tmp_path):
    path = write_bag(take, tmp_path / "a.mcap")
    assert path.stat().st_size < 6_000_000
    with BagReader(path) as bag:
        found = {m.topic.name: [] for m in bag.messages()}
        for message in bag.messages():
            found[message.topic.name].append(bag.deserialise(message))
    pictures = found["/head_front_camera/rgb/image_raw/compressed"]
    assert [bytes(p.data) for p in pictures] == [f.jpeg for f in take.stored]
    sound = b"".join(bytes(np.asarray(m.audio.data, np.uint8)) for m in found["/audio"])
    assert sound == take.samples.astype("<i2").tobytes()


def test_a_long_exposure_blurs_the_moving_hand_and_nothing_else(take):
    blurred, sharp = (
        make_take(replace(PLAN, conditions=replace(PLAN.conditions, exposure_s=exposure))) for exposure in (0.05, 0.0)
    )
    pairs = [
        (decode_colour(a.jpeg).astype(int), decode_colour(b.jpeg).astype(int))
        for a, b in zip(blurred.stored, sharp.stored, strict=True)
    ]
    changes = [float(np.abs(a - b).max()) for a, b in pairs]
    leaves, arrives = take.truth.pointing[0].end_s, take.truth.pointing[1].start_s
    moving = [c for c, f in zip(changes, sharp.stored, strict=True) if leaves < f.stamp_s < arrives]
    assert changes[0] == 0.0
    assert max(moving) > 40.0


def test_true_detections_cover_the_things_in_the_picture(take):
    states = take.truth.states
    scene = true_scene(
        states,
        PLAN.scene.table,
        ("mug", "container", "objects"),
        take.camera,
        camera_pose(take),
        take.stored[0].stamp_s,
    )
    kinds = [state.kind for state in states]
    assert [d.phrase_scores[0] > 0.4 for d in scene.detections] == [kind == "mug" for kind in kinds]
    picture = decode_colour(take.stored[0].jpeg).astype(int)
    for detection, state in zip(scene.detections, states, strict=True):
        inside = picture[detection.mask].mean(axis=0)
        around = picture[~detection.mask].mean(axis=0)
        assert np.abs(inside - around).max() > 15.0, state.id


def test_nothing_understood_is_a_miss(take):
    assert not judge(PLAN, take.truth.states, None).right


def test_the_generators_version_is_the_same_in_every_call():
    assert generator_version() == generator_version()


def test_a_journal_knows_what_an_interrupted_run_has_done(tmp_path):
    outcome = Outcome("s01t00seed0", 1, 0, 0, "plain", {}, "a", "a", {}, {}, right=True, why="")
    checkpoint = RunCheckpoint(tmp_path, {"takes": ["a"]})
    checkpoint.add(outcome)
    with next((tmp_path / "runs").iterdir()).open("a") as file:
        file.write('{"take": "s01t0')  # cut off while it was written
    assert RunCheckpoint(tmp_path, {"takes": ["a"]}).outcomes() == {"s01t00seed0": outcome}
    assert RunCheckpoint(tmp_path, {"takes": ["b"]}).outcomes() == {}
    assert RunCheckpoint(tmp_path, {"takes": ["a"]}, fresh=True).outcomes() == {}
