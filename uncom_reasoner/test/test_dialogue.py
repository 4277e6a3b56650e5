# SPDX-License-Identifier: Apache-2.0
"""Questions and answers: what splits the candidates, what counts as yes, and how a question ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reasoner_scenes import POSE, TABLE_Z, Thing, command, evidence, pointing, reference
from uncom_common.primitive import Primitive
from uncom_language.types import Act, Command, Relation
from uncom_perception.types import Attribute
from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import phrases_for
from uncom_reasoner.dialogue.answers import find_choice
from uncom_reasoner.dialogue.conversation import AmendedCommand, Conversation, Turn
from uncom_reasoner.dialogue.dialogue_state import Dialogue
from uncom_reasoner.dialogue.types import Answer, End, Question, QuestionKind, Verdict
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.types import Status
from uncom_reasoner.weights import load_weights

MUGS = [
    Thing("mug_1", "mug", 0.6, 0.25, colour="red"),
    Thing("mug_2", "mug", 0.62, -0.2, colour="blue"),
    Thing("bowl_1", "bowl", 0.75, 0.02),
    Thing("lemon_1", "lemon", 0.55, -0.4),
]
WHICH = Question("q1", "u1", QuestionKind.GROUNDING, "?", ("the red mug", "the blue mug"), ("a", "b"), 10.0, "object")
MAY_I = Question("approve-u1-0", "u1", QuestionKind.APPROVAL, "May I?", ("yes", "no"), (), 10.0)


def said(act: Act, text: str = "", **kwargs) -> Command:
    return Command("u2", act, text, **kwargs)


def fragment(text: str, act=Act.FRAGMENT, start=5.0, **kwargs) -> Command:
    words = text.split()
    obj = reference(text, start, start + 0.5, concrete=words[-1] not in ("one", "this"), **kwargs)
    return said(act, text, object=obj)


def asking(question: Question, at_s: float = 100.0) -> Dialogue:
    dialogue = Dialogue()
    dialogue.ask(question, at_s)
    return dialogue


# --- consent ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("act", [a for a in Act if a not in (Act.YES, Act.NO, Act.STOP, Act.CANCEL, Act.COMMAND)])
def test_what_is_not_a_plain_yes_never_approves_a_motion(act):
    """R1: "no" was once taken for yes; here only Act.YES is one, and what is unknown leaves the question open."""
    dialogue = asking(MAY_I)
    ending = dialogue.heard(said(act, "yes yes of course"))
    assert ending is None
    assert dialogue.question is MAY_I
    assert dialogue.reminder().startswith("Please say yes or no.")


def test_yes_approves_and_no_denies():
    assert asking(MAY_I).heard(said(Act.YES, "yes")).end is End.APPROVED
    assert asking(MAY_I).heard(said(Act.NO, "no")).end is End.DENIED
    assert asking(MAY_I).heard(said(Act.STOP, "stop")).end is End.STOPPED
    assert asking(MAY_I).heard(said(Act.COMMAND, "take the bowl")).end is End.DROPPED


@given(st.text(max_size=12), st.sampled_from(list(Verdict)), st.integers(-3, 3), st.text(max_size=12))
def test_an_answer_approves_only_with_yes_and_the_questions_own_id(question_id, verdict, choice, text):
    ending = asking(MAY_I).answered(Answer(question_id, verdict, choice, text))
    approved = ending is not None and ending.end is End.APPROVED
    assert approved == (question_id == MAY_I.id and verdict is Verdict.YES)
    exact = asking(MAY_I).answered(Answer(MAY_I.id, verdict, choice, text))
    assert (exact is not None and exact.end is End.APPROVED) == (verdict is Verdict.YES)


def test_pointing_never_approves_a_motion():
    assert asking(replace(MAY_I, candidate_ids=("a",))).pointed("a") is None


def test_silence_ends_a_question_and_only_once():
    """R11: the wait for consent ends by itself."""
    dialogue = asking(MAY_I)
    assert dialogue.tick(109.9) is None
    assert dialogue.tick(110.0).end is End.TIMED_OUT
    assert dialogue.tick(500.0) is None
    assert dialogue.heard(said(Act.YES, "yes")) is None  # too late


def test_reminders_do_not_go_on_for_ever():
    dialogue = asking(MAY_I)
    assert [bool(dialogue.reminder()) for _ in range(4)] == [True, True, False, False]


# --- naming a choice ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "chosen"),
    [
        ("the red one", "a"),
        ("red", "a"),
        ("the blue mug", "b"),
        ("the second one", "b"),
        ("the first", "a"),
        ("the last one", "b"),
        ("the mug", ""),
        ("red or blue", ""),
        ("not the red one", ""),
        ("bluetooth", ""),
        ("", ""),
        ("the reddish", ""),
        ("the third one", ""),
    ],
)
def test_whole_words_name_one_choice_or_none(text, chosen):
    """M13, M17: parts of words name nothing."""
    assert find_choice(text, WHICH) == chosen


@pytest.mark.parametrize(
    ("text", "side"),
    [("my left", "speaker"), ("as I see it", "speaker"), ("from your side", "robot"), ("the left", ""), ("yes", "")],
)
def test_my_left_is_the_speakers(text, side):
    question = replace(WHICH, part="perspective", candidate_ids=("robot", "speaker"))
    assert find_choice(text, question) == side


def test_yes_to_one_thing_means_it_and_to_two_means_nothing():
    assert asking(WHICH).heard(said(Act.YES, "yes")) is None
    one = replace(WHICH, choices=("the red mug",), candidate_ids=("a",))
    assert asking(one).heard(said(Act.YES, "yes")).candidate_id == "a"


def test_a_choice_by_number_must_exist():
    assert asking(WHICH).answered(Answer("q1", Verdict.CHOICE, 1)).candidate_id == "b"
    assert asking(WHICH).answered(Answer("q1", Verdict.CHOICE, 2)) is None
    assert asking(WHICH).answered(Answer("q1", Verdict.CHOICE, -1)) is None
    assert asking(WHICH).answered(Answer("other", Verdict.CHOICE, 1)) is None


# --- turns -------------------------------------------------------------------------------------------------------


def coloured(made):
    by_id = {t.id: t.colour for t in MUGS}
    seen = [replace(d, attributes=(Attribute("colour", by_id.get(d.id, ""), 0.9),)) for d in made.scene.detections]
    return replace(made, scene=replace(made.scene, detections=tuple(seen)))


def conversation(**kwargs) -> Conversation:
    return Conversation(load_weights(), PlacingConfig(**kwargs))


def ask(talk: Conversation, things=MUGS, obj="mug", **kwargs) -> Turn:
    cmd = command(reference(obj, 0, 1), reference("bowl", 1, 2), text=f"put the {obj} in the bowl", **kwargs)
    return talk.decide(coloured(evidence(cmd, things)), 10.0)


def again(talk: Conversation, change: AmendedCommand, hands=(), things=MUGS) -> Turn:
    """Look again with the amended command's phrases, as the node does."""
    made = coloured(evidence(change.command, things))
    assert made.phrases == phrases_for(change.command)
    rays = observe_rays(list(hands), lambda _: POSE)
    return talk.decide(replace(made, given=change.given, rays=rays), 12.0, change.questions_asked)


def test_two_that_fit_are_asked_about_by_what_tells_them_apart():
    turn = ask(conversation())
    assert turn.question.text == "Do you mean the red mug or the blue mug?"
    assert set(turn.question.candidate_ids) == {"mug_1", "mug_2"}
    assert turn.decisions[0].grounded.status is Status.AMBIGUOUS
    assert turn.decisions[0].grounded.reason == turn.question.text


@pytest.mark.parametrize(
    ("things", "words"),
    [
        ([("mug_a", 0.6, 0.25), ("mug_b", 0.6, -0.2)], ["the mug on the left", "the mug on the right"]),
        ([("mug_a", 0.52, 0.0), ("mug_b", 0.75, 0.01)], ["the mug in front", "the mug at the back"]),
    ],
)
def test_alike_things_are_told_apart_by_where_they_are(things, words):
    mugs = [Thing(name, "mug", x, y) for name, x, y in things]
    turn = ask(conversation(), [*mugs, Thing("bowl_1", "bowl", 0.7, 0.4)])
    assert sorted(turn.question.choices) == sorted(words)


def test_an_answer_by_words_grounds_the_same_command():
    talk = conversation()
    turn = ask(talk)
    ending = talk.dialogue.heard(fragment("blue one"))
    done = talk.conclude(ending, 11.0)
    assert isinstance(done, Turn)
    g = done.decisions[0].grounded
    assert (g.status, g.object.id, g.target.detection.id) == (Status.GROUNDED, "mug_2", "bowl_1")
    assert (g.utterance_id, g.index) == (turn.command.utterance_id, turn.command.index)


def test_an_answer_by_pointing_grounds_it_without_a_word():
    talk = conversation()
    ask(talk)
    before = pointing((0.62, -0.2, TABLE_Z + 0.04), (0.8, -0.1, 0.95), np.arange(9.0, 10.0, 0.1))
    assert talk.pointing_answer(observe_rays(before, lambda _: POSE), 10.0, 11.5) is None  # the hand was there before
    hands = pointing((0.6, 0.25, TABLE_Z + 0.04), (0.8, 0.1, 0.95), np.arange(10.5, 11.5, 0.1))
    ending = talk.pointing_answer(observe_rays(hands, lambda _: POSE), 10.0, 11.5)
    assert ending.candidate_id == "mug_1"
    assert talk.conclude(ending, 11.5).decisions[0].grounded.object.id == "mug_1"


def test_this_one_with_a_gesture_is_looked_at_again_among_the_choices():
    talk = conversation()
    ask(talk)
    ending = talk.dialogue.heard(fragment("this one", start=11.0, deictic="this", head="one", modifiers=()))
    change = talk.conclude(ending, 12.0)
    assert isinstance(change, AmendedCommand)
    hands = pointing((0.62, -0.2, TABLE_Z + 0.04), (0.8, -0.1, 0.95), np.arange(10.8, 11.8, 0.1))
    g = again(talk, change, hands).decisions[0].grounded
    assert (g.status, g.object.id) == (Status.GROUNDED, "mug_2")


def test_a_place_that_was_not_seen_is_shown_by_a_hand():
    talk = conversation()
    here = reference("here", 1, 2, concrete=False, deictic="here")
    cmd = command(reference("lemon", 0, 1), here, relation=Relation.HERE, primitive=Primitive.PLACE)
    turn = talk.decide(coloured(evidence(cmd, MUGS)), 10.0)
    assert turn.question.text == "I did not see where you pointed. Please point at it again."
    hands = pointing((0.55, 0.05, TABLE_Z), (0.7, 0.1, 0.9), np.arange(10.5, 11.5, 0.1))
    change = talk.conclude(talk.pointing_answer(observe_rays(hands, lambda _: POSE), 10.0, 11.5), 11.5)
    g = again(talk, change, hands).decisions[0].grounded
    assert g.status is Status.GROUNDED
    assert np.hypot(*(g.target.pose[:2, 3] - [0.55, 0.05])) < 0.05


def test_no_to_the_only_guess_ends_in_a_refusal():
    talk = conversation()
    cmd = command(reference("tomato", 0.2, 1.0, deictic="this"), None, text="take this tomato")
    hands = pointing((0.6, 0.25, TABLE_Z + 0.04), (0.8, 0.1, 0.95), np.arange(0.2, 1.0, 0.1))
    made = replace(coloured(evidence(cmd, MUGS)), rays=observe_rays(hands, lambda _: POSE))
    turn = talk.decide(made, 10.0)
    assert turn.question.text == "I do not see the tomato on the table. Do you mean the mug?"
    turn = talk.conclude(talk.dialogue.heard(said(Act.NO, "no")), 11.0)
    assert turn.decisions[0].grounded.status in (Status.FAILED, Status.AMBIGUOUS)
    assert "mug_1" not in (turn.question.candidate_ids if turn.question else ())


def test_a_time_out_leaves_everything_as_it_was():
    talk = conversation()
    ask(talk)
    memory = talk.memory
    turn = talk.conclude(talk.dialogue.tick(1000.0), 1000.0)
    assert turn.decisions[0].grounded.status is Status.CANCELLED
    assert talk.memory is memory
    assert talk.last is None
    assert ask(talk).question is not None  # and the next command works


@pytest.mark.parametrize("act", [Act.NO, Act.STOP, Act.COMMAND])
def test_no_stop_and_a_new_command_take_it_back(act):
    talk = conversation()
    ask(talk)
    turn = talk.conclude(talk.dialogue.heard(said(act, "no")), 11.0)
    assert turn.decisions[0].grounded.status is Status.CANCELLED


def test_questions_about_one_command_are_few():
    talk = conversation()
    turn = ask(talk)
    asked = 1
    while turn.question is not None:
        change = talk.conclude(talk.dialogue.heard(fragment("one", head="one", modifiers=())), 11.0)
        turn = again(talk, change)
        asked += turn.question is not None
    assert asked <= 3
    assert turn.decisions[0].grounded.status is Status.FAILED


def test_object_and_target_are_asked_about_one_after_the_other():
    talk = conversation()
    turn = ask(talk, [*MUGS, Thing("bowl_2", "bowl", 0.55, 0.42, colour="green")])
    assert turn.question.part == "object"
    turn = talk.conclude(talk.dialogue.answered(Answer(turn.question.id, Verdict.CHOICE, 0)), 11.0)
    assert turn.question.part == "target"
    first = turn.question.candidate_ids[0]
    turn = talk.conclude(talk.dialogue.answered(Answer(turn.question.id, Verdict.CHOICE, 0)), 12.0)
    assert turn.decisions[0].grounded.target.detection.id == first


# --- corrections -------------------------------------------------------------------------------------------------


def grounded(talk: Conversation, text="red mug") -> Turn:
    turn = ask(talk, obj=text)
    assert turn.decisions[0].grounded.object.id == "mug_1"
    return turn


def test_no_the_blue_one_amends_the_last_command():
    talk = conversation()
    grounded(talk)
    change = talk.correct(fragment("blue one", Act.CORRECTION, head="one"))
    g = again(talk, change).decisions[0].grounded
    assert (g.object.id, g.target.detection.id) == ("mug_2", "bowl_1")
    assert change.replaces.utterance_id == "u1"


def test_a_correction_of_the_place_keeps_the_thing():
    talk = conversation()
    grounded(talk)
    beside = said(Act.CORRECTION, "no, next to the lemon", target=reference("lemon", 5, 6), relation=Relation.NEXT_TO)
    g = again(talk, talk.correct(beside)).decisions[0].grounded
    assert (g.object.id, g.primitive, g.relation) == ("mug_1", Primitive.PLACE.value, "next_to")
    assert np.hypot(*(g.target.pose[:2, 3] - [0.55, -0.4])) < 0.25


def test_a_bit_to_the_right_starts_from_where_it_was_to_go():
    talk = conversation()
    cmd = command(
        reference("lemon", 0, 1), reference("bowl", 1, 2), relation=Relation.RIGHT_OF, primitive=Primitive.PLACE
    )
    first = talk.decide(coloured(evidence(cmd, MUGS)), 10.0).decisions[0].grounded
    bit = said(Act.CORRECTION, "a bit to the right", relation=Relation.RIGHT_OF, distance_m=0.05)
    second = again(talk, talk.correct(bit)).decisions[0].grounded
    assert second.object.id == first.object.id
    assert first.target.pose[1, 3] - second.target.pose[1, 3] == pytest.approx(0.05, abs=0.025)


def test_put_it_back_goes_to_where_it_was():
    talk = conversation()
    cmd = command(
        reference("lemon", 0, 1), reference("bowl", 1, 2), relation=Relation.IN_FRONT_OF, primitive=Primitive.PLACE
    )
    goal = talk.decide(coloured(evidence(cmd, MUGS)), 10.0).decisions[0].grounded.target.pose[:2, 3]
    moved = [t for t in MUGS if t.id != "lemon_1"] + [Thing("lemon_1", "lemon", *map(float, goal))]
    it = reference("it", 20, 20.3, concrete=False, anaphoric=True)
    back = command(it, None, action_text="put back", primitive=Primitive.PLACE)
    g = talk.decide(coloured(evidence(back, moved)), 21.0).decisions[0].grounded
    assert (g.status, g.object.id) == (Status.GROUNDED, "lemon_1")
    assert np.hypot(*(g.target.pose[:2, 3] - [0.55, -0.4])) < 0.02


def test_a_correction_without_a_command_before_is_none():
    assert conversation().correct(fragment("blue one", Act.CORRECTION)) is None
