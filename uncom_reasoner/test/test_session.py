# SPDX-License-Identifier: Apache-2.0
"""The session alone, with a clock and a detector made for the test: every act, late hands, corrections, time-outs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from reasoner_scenes import CAMERA, POSE, TABLE_Z, Thing, command, pointing, reference, scene
from uncom_common.exceptions import UncomError
from uncom_common.transforms import StampedTransform
from uncom_language.types import Act, Command, Relation
from uncom_perception.types import HandsFrame
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.dialogue.types import Answer, QuestionKind, Verdict
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.session.events import AnswerGiven, DecisionDue, QuestionAsked, Report, Say, StageTimes, StopMotion
from uncom_reasoner.session.session import Session
from uncom_reasoner.session.synchronous import run_tasks
from uncom_reasoner.session.task import DetectionRequest
from uncom_reasoner.types import Status
from uncom_reasoner.weights import load_weights

OPTICAL = "optical"
THINGS = [
    Thing("lemon_1", "lemon", 0.6, 0.1),
    Thing("lemon_2", "lemon", 0.65, 0.32),
    Thing("bowl_1", "bowl", 0.7, -0.2),
]
AT_LEMON_1 = ((0.6, 0.1, TABLE_Z + 0.02), (0.75, 0.2, 0.9))


@dataclass
class FakeClock:
    """A clock that stands still until it is moved."""

    now_s: float = 0.0

    def stamp_s(self) -> float:
        return self.now_s

    def steady_s(self) -> float:
        return self.now_s + 1000.0


class World:
    """A session with what it sees: images eight times a second, and a detector that answers at once."""

    def __init__(self, **parameters):
        self.clock = FakeClock()
        self.session = Session(ReasonerConfig(**parameters), load_weights(), self.clock)
        self.requests = []
        self.things = THINGS
        memory = self.session.memory
        memory.camera, memory.camera_frame = CAMERA, OPTICAL
        memory.transforms.add(StampedTransform(0.0, memory.base_frame, OPTICAL, POSE), static=True)

    def see(self, until_s, hand_from=float("inf"), start_s=0.0, hands_until_s=float("inf"), at=AT_LEMON_1):
        """Let images come, with a hand in them from some time on; the gesture node may lag behind."""
        for t in np.arange(start_s, until_s, 0.125):
            self.session.memory.images.add(float(t), "image")
            if t > hands_until_s:
                continue
            (frame,) = pointing(*at, np.array([t]))
            self.session.memory.hands.add(float(t), frame if t >= hand_from else empty(t))
        self.clock.now_s = max(self.clock.now_s, until_s)

    def detect(self, request):
        self.requests.append(request)
        return scene(self.things, request.phrases)

    def run(self):
        return run_tasks(self.session, self.detect)

    def tell(self, cmd):
        return (*self.session.interrupt(cmd), *self.session.hear(cmd), *self.run())

    def wait(self, duration_s):
        self.clock.now_s += duration_s


def empty(t):
    return HandsFrame(float(t), "camera", 640, 480, ())


def lemon_to_bowl(obj="lemon", start_s=1.7, **kwargs):
    words = (reference(obj, start_s, start_s + 0.3, **kwargs), reference("bowl", start_s + 0.5, start_s + 0.6))
    return command(*words, text=f"put the {obj} in the bowl")


def said(act, text="", **kwargs):
    return Command("u2", act, text, **kwargs)


def reports(events):
    return [event.decision.grounded for event in events if isinstance(event, Report)]


def sayings(events):
    return [event.text for event in events if isinstance(event, Say)]


@pytest.fixture(name="world")
def _world():
    """A table that was seen for three seconds, with a hand at lemon 1 from 1.6 s on."""
    world = World()
    world.see(3.0, hand_from=1.6)
    return world


@pytest.fixture(name="doubtful")
def _doubtful():
    """A session that has just asked which of two lemons is meant."""
    world = World()
    world.see(1.5)
    world.asked = world.tell(lemon_to_bowl(start_s=0.2))
    return world


# --- commands ----------------------------------------------------------------------------------------------------


def test_a_command_is_reported_said_and_measured(world):
    events = world.tell(lemon_to_bowl())
    times, report, words = events
    assert isinstance(times, StageTimes)
    assert set(times.durations_s) == {"detection", "hands", "deciding"}
    assert (report.decision.grounded.status, report.decision.grounded.object.id) == (Status.GROUNDED, "lemon_1")
    assert words == Say("I take the lemon and put it in the bowl.")
    assert report.sentence == words.text
    assert report.evidence.phrases == ("lemon", "bowl", "container", "objects")


def test_objects_are_looked_for_in_a_frame_before_the_hand(world):
    (report,) = [event for event in world.tell(lemon_to_bowl()) if isinstance(event, Report)]
    (request,) = world.requests
    assert not request.frame.with_hand
    assert request.frame.stamp_s < 1.6 - 0.7
    assert report.scene_s == request.frame.stamp_s


def test_a_detection_is_returned_as_a_value_and_nothing_waits_for_it(world):
    session = world.session
    assert session.hear(lemon_to_bowl()) == ()
    assert session.advance(detector_ready=False) == ()
    (request,) = session.advance(detector_ready=True)
    assert isinstance(request, DetectionRequest)
    assert session.is_working
    assert session.advance(detector_ready=True) == ()
    session.take_scene(DetectionRequest(request.frame, request.phrases), scene(THINGS, request.phrases))
    assert session.advance(detector_ready=True) == ()  # an equal request of somebody else is not this task's
    session.take_scene(request, scene(THINGS, request.phrases))
    (due,) = session.advance(detector_ready=True)
    assert isinstance(due, DecisionDue)
    assert reports(session.decide(due.task))[0].status is Status.GROUNDED
    assert not session.is_working


def test_two_commands_are_grounded_one_after_the_other():
    world = World()
    world.see(3.0)
    world.things = [THINGS[0], THINGS[2]]
    world.session.hear(lemon_to_bowl())
    world.session.hear(replace(command(reference("bowl", 2.2, 2.3)), index=1))
    found = reports(world.run())
    assert [(g.index, g.object.id) for g in found] == [(0, "lemon_1"), (1, "bowl_1")]


def test_a_group_has_a_report_for_each_object_and_one_sentence(world):
    both = command(reference("lemon", 0.2, 0.5, quantity=2), reference("bowl", 0.6, 0.8), text="both lemons")
    events = world.tell(both)
    assert [(g.part, g.parts) for g in reports(events)] == [(0, 2), (1, 2)]
    assert len(sayings(events)) == 1


def test_put_it_back_is_a_command_though_it_names_no_place(world):
    world.tell(lemon_to_bowl())
    it = reference("it", 2.5, 2.6, concrete=False, anaphoric=True)
    events = world.tell(Command("u3", Act.INCOMPLETE, "put it back", action_text="put back", object=it))
    assert reports(events)[0].object.id == "lemon_1"


# --- what is not a command ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("act", [Act.REFUSED, Act.INCOMPLETE, Act.FRAGMENT])
def test_what_is_no_command_is_refused_with_its_reason(world, act):
    events = world.tell(said(act, "hello", reason="I heard no command."))
    assert reports(events)[0].status is Status.FAILED
    assert sayings(events) == ["I heard no command."]


@pytest.mark.parametrize("act", [Act.YES, Act.NO])
def test_yes_and_no_without_a_question_do_nothing(world, act):
    assert world.tell(said(act, "yes")) == ()


@pytest.mark.parametrize("act", [Act.STOP, Act.CANCEL])
def test_stop_ends_the_motion_at_once_and_drops_what_waits(world, act):
    world.session.hear(lemon_to_bowl())
    assert world.session.interrupt(said(act, "stop")) == (StopMotion(),)
    assert world.session.hear(said(act, "stop")) == ()
    assert world.run() == ()
    assert world.session.interrupt(lemon_to_bowl()) == ()


def test_a_decision_that_was_stopped_in_between_is_not_told_and_the_next_command_works(world):
    session = world.session
    session.hear(lemon_to_bowl())
    (request,) = session.advance(detector_ready=True)
    session.take_scene(request, scene(THINGS, request.phrases))
    (due,) = session.advance(detector_ready=True)
    session.interrupt(said(Act.STOP, "stop"))
    assert session.decide(due.task) == ()
    assert reports(world.tell(lemon_to_bowl()))[0].status is Status.GROUNDED


def test_a_scene_that_comes_after_a_stop_is_left(world):
    session = world.session
    session.hear(lemon_to_bowl())
    (request,) = session.advance(detector_ready=True)
    session.interrupt(said(Act.STOP, "stop"))
    session.take_scene(request, scene(THINGS, request.phrases))
    assert session.take_failure(request, "dark") == ()
    assert session.advance(detector_ready=True) == ()


def test_nothing_is_decided_before_something_was_seen(world):
    world.session.hear(lemon_to_bowl())
    (request,) = world.session.advance(detector_ready=True)
    task = world.session._first_task()
    assert task.request is request
    with pytest.raises(InvalidGroundingError, match="before anything was seen"):
        world.session.decide(task)


# --- waiting -----------------------------------------------------------------------------------------------------


def test_hands_that_come_late_are_waited_for_and_the_gesture_counts():
    world = World()
    world.see(2.6, hand_from=1.6, hands_until_s=1.5)
    this = reference("this", 1.8, 2.0, concrete=False, deictic="this")
    assert world.tell(command(this, text="take this")) == ()
    for t in np.arange(1.5, 2.4, 0.125):
        world.session.memory.hands.add(float(t), pointing(*AT_LEMON_1, np.array([t]))[0])
    (g,) = reports(world.run())
    assert (g.status, g.object.id) == (Status.GROUNDED, "lemon_1")


def test_without_hands_the_wait_ends_and_the_words_alone_count():
    world = World(wait_timeout_s=1.0)
    world.see(3.0, hands_until_s=-1.0)
    assert world.tell(command(reference("bowl", 1.8, 2.0))) == ()
    world.wait(1.1)
    assert reports(world.run())[0].object.id == "bowl_1"


def test_without_images_the_person_is_told():
    world = World(wait_timeout_s=0.3)
    assert world.tell(lemon_to_bowl(start_s=-3.0)) == ()
    world.wait(0.4)
    assert sayings(world.run()) == ["I see nothing: no camera images arrive."]


def test_a_detector_that_is_not_there_or_does_not_answer_fails_one_command_only():
    world = World(detect_timeout_s=0.5)
    world.see(3.0, hand_from=1.6)
    session = world.session
    session.hear(lemon_to_bowl())
    assert session.advance(detector_ready=False) == ()
    world.wait(0.6)
    assert "not running" in sayings(session.advance(detector_ready=False))[0]
    session.hear(lemon_to_bowl())
    (request,) = session.advance(detector_ready=True)
    world.wait(0.6)
    assert "does not answer" in sayings(session.advance(detector_ready=True))[0]
    session.take_scene(request, scene(THINGS, request.phrases))  # too late
    assert reports(world.tell(lemon_to_bowl()))[0].status is Status.GROUNDED


def test_a_detector_that_fails_tells_why(world):
    def broken(_request):
        raise UncomError("the lens is covered")

    world.session.hear(lemon_to_bowl())
    assert sayings(run_tasks(world.session, broken)) == ["I cannot look at the table: the lens is covered"]


def test_the_table_is_looked_at_ahead_in_the_frame_that_the_command_asks_for():
    world = World()
    world.see(1.5)
    (ahead,) = world.session.look_ahead()
    assert ahead.phrases == ("container", "objects")
    world.see(3.0, start_s=1.5)
    world.tell(lemon_to_bowl())
    assert world.requests[0].frame == ahead.frame


# --- questions ---------------------------------------------------------------------------------------------------


def test_a_doubt_is_asked_about_once(doubtful):
    (question,) = [event.question for event in doubtful.asked if isinstance(event, QuestionAsked)]
    assert set(question.candidate_ids) == {"lemon_1", "lemon_2"}
    assert sayings(doubtful.asked) == [question.text]
    assert reports(doubtful.asked)[0].status is Status.AMBIGUOUS
    assert doubtful.session.awaits_answer


def question_of(world):
    return world.session.conversation.dialogue.question


def test_a_fragment_answers_the_question(doubtful):
    question = question_of(doubtful)
    wanted = question.choices[question.candidate_ids.index("lemon_2")]
    obj = reference(wanted.removeprefix("the "), 2.0, 2.5)
    (g,) = reports(doubtful.tell(said(Act.FRAGMENT, wanted, object=obj)))
    assert (g.status, g.object.id, g.utterance_id) == (Status.GROUNDED, "lemon_2", "u1")


def test_an_answer_by_message_answers_it_and_one_to_another_question_does_not(doubtful):
    session, question = doubtful.session, question_of(doubtful)
    assert session.take_answer(Answer("another", Verdict.CHOICE, 0)) == ()
    assert session.take_answer(Answer(question.id, Verdict.UNKNOWN)) == ()
    (g,) = reports(session.take_answer(Answer(question.id, Verdict.CHOICE, 1)))
    assert g.object.id == question.candidate_ids[1]


def test_a_hand_answers_it(doubtful):
    doubtful.see(3.2, start_s=1.8, hand_from=1.8)
    (g,) = reports(doubtful.session.check_answers())
    assert (g.status, g.object.id) == (Status.GROUNDED, "lemon_1")


def test_silence_ends_it_without_effect(doubtful):
    assert doubtful.session.check_answers() == ()
    doubtful.wait(15.1)
    events = doubtful.session.check_answers()
    assert reports(events)[0].status is Status.CANCELLED
    assert sayings(events) == ["I got no answer, so I leave everything as it is."]
    assert not doubtful.session.awaits_answer


@pytest.mark.parametrize("act", [Act.STOP, Act.CANCEL, Act.NO])
def test_stop_and_no_end_it_without_effect(doubtful, act):
    (g,) = reports(doubtful.tell(said(act, "stop")))
    assert g.status is Status.CANCELLED


def test_yes_to_a_choice_of_two_is_not_understood(doubtful):
    assert sayings(doubtful.tell(said(Act.YES, "yes"))) == [f"I did not understand that. {question_of(doubtful).text}"]
    assert question_of(doubtful) is not None


def test_a_new_command_takes_its_place(doubtful):
    doubtful.see(3.0, start_s=1.5)
    found = reports(doubtful.tell(replace(command(reference("bowl", 2.0, 2.2)), utterance_id="u9")))
    assert [(g.utterance_id, g.status) for g in found] == [("u1", Status.CANCELLED), ("u9", Status.GROUNDED)]


def test_a_further_command_of_the_same_utterance_waits_for_the_answer(doubtful):
    session = doubtful.session
    assert doubtful.tell(replace(command(reference("bowl", 0.9, 1.0)), index=1)) == ()
    question = question_of(doubtful)
    events = (*session.take_answer(Answer(question.id, Verdict.CHOICE, 0)), *doubtful.run())
    assert [g.index for g in reports(events)] == [0, 1]


# --- corrections -------------------------------------------------------------------------------------------------


def test_a_correction_takes_the_command_back_and_grounds_the_amended_one(world):
    world.tell(lemon_to_bowl())
    other = reference("one", 2.6, 2.7, other=True, concrete=False)
    found = reports(world.tell(said(Act.CORRECTION, "no, the other one", object=other)))
    assert [(g.status, g.utterance_id) for g in found] == [(Status.CANCELLED, "u1"), (Status.GROUNDED, "u2")]
    assert found[1].object.id == "lemon_2"


def test_a_correction_of_nothing_is_refused(world):
    bowl = reference("bowl", 2.6, 2.7)
    events = world.tell(said(Act.CORRECTION, "no, the bowl", target=bowl, relation=Relation.IN))
    assert sayings(events) == ["I have done nothing that I could correct."]


# --- consent -----------------------------------------------------------------------------------------------------


def test_consent_is_asked_for_once_with_what_would_be_done(world):
    world.tell(lemon_to_bowl())
    consent = world.session.consent
    asked, words = consent.request("u1", 0)
    assert (asked.question.id, asked.question.kind) == ("approve-u1-0", QuestionKind.APPROVAL)
    assert words.text == "Shall I take the lemon and put it in the bowl?"
    assert consent.request("u1", 0) == ()
    assert consent.adopt(asked.question) == ()


@pytest.mark.parametrize(
    ("act", "verdict"),
    [(Act.YES, Verdict.YES), (Act.NO, Verdict.NO), (Act.STOP, Verdict.NO), (Act.CANCEL, Verdict.NO)],
)
def test_only_a_spoken_yes_is_consent(world, act, verdict):
    """R1."""
    world.session.consent.request("u1", 0)
    answers = [event.answer for event in world.tell(said(act, "?")) if isinstance(event, AnswerGiven)]
    assert [(a.question_id, a.verdict) for a in answers] == [("approve-u1-0", verdict)]


def test_what_is_not_understood_is_no_consent_and_a_command_is_a_no(world):
    world.session.consent.request("u1", 0)
    events = world.tell(said(Act.REFUSED, "yes yes maybe", reason="?"))
    assert not any(isinstance(event, AnswerGiven) for event in events)
    assert sayings(events)[0] == "Please say yes or no. May I move?"
    events = world.tell(lemon_to_bowl())
    assert next(e.answer.verdict for e in events if isinstance(e, AnswerGiven)) is Verdict.NO
    assert reports(events)[0].status is Status.GROUNDED


def test_silence_is_no_consent(world):
    world.session.consent.request("u1", 0)
    world.wait(60.1)
    (event,) = world.session.check_answers()
    assert event.answer.verdict is Verdict.NO


def test_a_motion_that_went_on_closes_the_question(world):
    consent = world.session.consent
    consent.request("u1", 0)
    consent.motion_went_on("u1", 1)
    assert consent.question is not None
    consent.motion_went_on("u1", 0)
    assert consent.question is None
    assert consent.answer(yes=True, text="by service") == ()
