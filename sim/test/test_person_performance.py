# SPDX-License-Identifier: Apache-2.0
"""The person speaks, points at the right thing while its words are spoken, and leaves."""

from __future__ import annotations

import numpy as np
import pytest
from uncom_sim.exceptions import VoiceError
from uncom_sim.person.behaviour import plan_behaviour
from uncom_sim.person.hand_model import HandLandmark, build_hand
from uncom_sim.person.hand_placement import Obstacle, robot_viewpoint
from uncom_sim.person.phrases import find_phrases
from uncom_sim.person.voice import VOICES, speak
from uncom_sim.types import SAMPLE_RATE_HZ, PersonOptions, Table

TABLE = Table()
LEMON, BOWL = np.array([0.58, -0.2, 0.745]), np.array([0.64, 0.16, 0.752])
OBSTACLES = (Obstacle(LEMON, np.full(3, 0.03)), Obstacle(BOWL, np.array([0.09, 0.09, 0.033])))
SAY = "take the lemon and put it in this bowl"


def _perform(say=SAY, seed=0, targets=None, **options):
    pointed = {"object": LEMON, "target": BOWL} if targets is None else targets
    return plan_behaviour(say, pointed, OBSTACLES, TABLE, PersonOptions(**options), np.random.default_rng(seed))


def _ray(person, t_s):
    pose = person.hand_at(t_s)
    joints = person.hand.joints @ pose[:3, :3].T + pose[:3, 3]
    return joints[HandLandmark.INDEX_BASE], joints[HandLandmark.INDEX_TIP]


@pytest.mark.parametrize(
    ("say", "thing", "place"),
    [
        ("take the lemon and put it in this bowl", "the lemon", "this bowl"),
        ("take this and put it here", "this", "here"),
        ("take this banana and put it to the right of the box", "this banana", "the box"),
        ("put banana in bowl", "banana", "bowl"),
        ("place the cup next to the plate over there", "the cup", "over there"),
        ("grab the left mug", "the left mug", None),
        ("pick up that red apple, and move it behind the cereal box", "that red apple", "the cereal box"),
        ("could you put my orange on the plate", "my orange", "the plate"),
        ("hello there", None, None),
        ("", None, None),
    ],
)
def test_phrases_follow_from_the_small_words_of_any_sentence(say, thing, place):
    words = say.split()
    phrases = find_phrases(words)
    for span, text in ((phrases.object, thing), (phrases.target, place)):
        assert (None if span is None else " ".join(words[slice(*span)]).strip(",")) == text


@pytest.mark.parametrize("side", ["far", "left", "right"])
@pytest.mark.parametrize("hand", ["left", "right"])
def test_the_index_line_goes_through_what_is_spoken_of(side, hand):
    person = _perform(side=side, hand=hand, seed=3)
    phrases = find_phrases([word.text for word in person.words])
    for span, target in ((phrases.object, LEMON), (phrases.target, BOWL)):
        first, last = person.words[span[0]], person.words[span[1] - 1]
        for t_s in np.linspace(first.start_s + 0.15, last.end_s, 5):
            base, tip = _ray(person, float(t_s))
            along = (tip - base) / np.linalg.norm(tip - base)
            distance = float((target - tip) @ along)
            assert 0.05 < distance < 0.28
            assert np.linalg.norm(target - tip - distance * along) < 0.006
            assert tip[2] > target[2] + 0.02


def test_the_hand_comes_after_the_start_and_is_gone_at_the_end():
    person = _perform()
    assert person.hand_at(0.0) is None
    assert person.hand_at(0.45) is None
    assert person.hand_at(person.duration_s - 0.5) is None
    camera = robot_viewpoint()
    for move, at in ((person.moves[0], "start"), (person.moves[-1], "end")):
        pose = getattr(move, at)
        pixels = camera.pixels(person.hand.joints @ pose[:3, :3].T + pose[:3, 3])
        outside = (pixels < 0).any(axis=1) | (pixels[:, 0] > 640) | (pixels[:, 1] > 480) | np.isnan(pixels).any(axis=1)
        assert outside.all()


def test_the_hand_moves_smoothly_and_never_through_the_table():
    person = _perform(seed=5)
    times = np.arange(0.0, person.duration_s, 0.01)
    poses = [person.hand_at(float(t)) for t in times]
    tips = np.array([p[:3, 3] for p in poses if p is not None])
    speed = np.linalg.norm(np.diff(tips, axis=0), axis=1) / 0.01
    assert speed.max() < 2.5
    for pose in poses:
        if pose is not None:
            joints = person.hand.joints @ pose[:3, :3].T + pose[:3, 3]
            assert joints[:, 2].min() > TABLE.height + 0.02


def test_nothing_to_point_at_means_no_hand():
    person = _perform("put the banana in the bowl", targets={})
    assert person.moves == ()
    assert all(person.hand_at(t) is None for t in np.linspace(0, person.duration_s, 20))


def test_a_person_pauses_rather_than_point_too_late():
    person = _perform("put this here", targets={"object": LEMON, "target": BOWL}, speed=170)
    here = person.words[-1]
    target = next(p for p in person.pointing if p.role == "target")
    assert target.start_s < here.start_s + 0.2
    assert target.end_s > here.end_s


def test_the_same_seed_gives_the_same_person_and_another_gives_another():
    a, b, c = _perform(seed=4), _perform(seed=4), _perform(seed=5)
    assert np.array_equal(a.samples, b.samples)
    assert a.attributes == b.attributes
    assert a.attributes != c.attributes
    assert _perform(seed=5, hand="left", voice="en-us").attributes.hand == "left"


def test_the_sound_lasts_as_long_as_the_performance_and_holds_the_words():
    person = _perform()
    assert person.samples.dtype == np.int16
    assert len(person.samples) == pytest.approx(person.duration_s * SAMPLE_RATE_HZ, abs=2)
    assert [word.text for word in person.words] == SAY.split()
    level = np.abs(person.samples.astype(float))
    for word in person.words:
        assert word.end_s > word.start_s
        assert level[int(word.start_s * SAMPLE_RATE_HZ) : int(word.end_s * SAMPLE_RATE_HZ)].max() > 1000
    assert level[: int((person.words[0].start_s - 0.05) * SAMPLE_RATE_HZ)].max() < 600
    assert level[int((person.words[-1].end_s + 0.1) * SAMPLE_RATE_HZ) :].max() < 600


def test_background_noise_is_as_strong_as_asked():
    quiet, loud = _perform(noise=0.0), _perform(noise=0.3)
    before = int(0.4 * SAMPLE_RATE_HZ)
    assert quiet.samples[:before].std() < 5
    assert 100 < loud.samples[:before].std() < 3000


@pytest.mark.parametrize("voice", VOICES)
def test_every_voice_speaks_every_word_in_order(voice):
    spoken = speak(SAY, voice, 150)
    starts = [word.start_s for word in spoken.words]
    assert starts == sorted(starts)
    assert 1.2 < spoken.duration_s < 4.0


def test_silence_and_strangers():
    assert speak("").duration_s == 0.0
    assert speak(" ... ").words == ()
    with pytest.raises(VoiceError, match="no voice 'nobody'"):
        speak("hello", "nobody")
    person = _perform("", targets={})
    assert person.words == ()
    assert np.abs(person.samples).max() < 200


def test_a_left_hand_is_the_mirror_of_a_right_one_and_both_are_closed_skins():
    left, right = (build_hand(side, 1.0, 0.3, (0.2, 0.2, 0.2)) for side in ("left", "right"))
    assert np.allclose(left.joints * (1, -1, 1), right.joints)
    for hand in (left, right):
        skin = hand.parts[0]
        assert len(skin.faces) < 12000
        corners = skin.vertices[skin.faces]
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        agree = np.einsum("ij,ij->i", outward, skin.normals[skin.faces[:, 0]]) > -1e-9
        assert agree.mean() > 0.98
