# SPDX-License-Identifier: Apache-2.0
"""The node over real DDS, with a detector made for the test: it answers from a scene made of numbers."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from reasoner_scenes import CAMERA, POSE, TABLE_Z, Thing, command, pointing, reference, scene
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Empty, String
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage
from uncom_common.conversions import camera_to_msg, depth_to_msg, header_to_msg, rgb_to_msg, stamped_transform_to_msg
from uncom_common.transforms import StampedTransform
from uncom_language.conversions import command_to_msg
from uncom_language.types import Act, Command
from uncom_perception.conversions import hands_to_msg, scene_to_response
from uncom_reasoner.reasoner_node import ReasonerNode

from uncom_interfaces.msg import Answer, ExecutionStatus, Explanation, GroundedCommand, Hands, Question, SpeechStatus
from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.srv import Detect

DOMAIN = 71
OPTICAL = "head_front_camera_rgb_optical_frame"
THINGS = [
    Thing("lemon_1", "lemon", 0.6, 0.1),
    Thing("lemon_2", "lemon", 0.65, 0.32),
    Thing("bowl_1", "bowl", 0.7, -0.2),
]


class Surroundings:
    """All that the reasoner talks to: camera, hands, transforms, detector; and what it answers."""

    def __init__(self, context, detector=True):
        self.node = rclpy.create_node("surroundings", context=context)
        self.received = {}
        self.changed = threading.Condition()
        self.requests = []
        self.start_s = time.time()
        n = self.node
        fixed = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.tf = n.create_publisher(TFMessage, "/tf_static", fixed)
        self.rgb = n.create_publisher(Image, "/head_front_camera/rgb/image_raw", 20)
        self.depth = n.create_publisher(Image, "/head_front_camera/depth_registered/image_raw", 20)
        self.info = n.create_publisher(CameraInfo, "/head_front_camera/rgb/camera_info", 20)
        self.hands = n.create_publisher(Hands, "/uncom/hands", 50)
        self.command = n.create_publisher(CommandMsg, "/uncom/command", 10)
        self.status = n.create_publisher(ExecutionStatus, "/uncom/execution_status", 10)
        self.speech = n.create_publisher(SpeechStatus, "/uncom/speech_status", 10)
        self.answer = n.create_publisher(Answer, "/uncom/answer", 10)
        self.question = n.create_publisher(Question, "/uncom/question", 10)
        self.approve = n.create_client(SetBool, "/uncom/approve")
        self.broken = False
        for kind, topic in (
            (GroundedCommand, "/uncom/grounded_command"),
            (Explanation, "/uncom/explanation"),
            (Image, "/uncom/annotated"),
            (String, "/uncom/say"),
            (Empty, "/uncom/stop"),
            (Question, "/uncom/question"),
            (Answer, "/uncom/answer"),
        ):
            n.create_subscription(kind, topic, lambda msg, topic=topic: self._keep(topic, msg), 10)
        if detector:
            n.create_service(Detect, "/uncom/detect", self._detect)

    def _keep(self, topic, msg):
        with self.changed:
            self.received.setdefault(topic, []).append(msg)
            self.changed.notify_all()

    def _detect(self, request, response):
        self.requests.append(request)
        if self.broken:
            response.success, response.reason = False, "the lens is covered"
            return response
        found = scene(THINGS, tuple(request.phrases))
        return scene_to_response(found, response)

    def wait(self, topic, count=1, timeout=20.0):
        with self.changed:
            assert self.changed.wait_for(lambda: len(self.received.get(topic, [])) >= count, timeout), topic
            return self.received[topic][count - 1]

    def connected(self, publishers, timeout=20.0):
        end = time.monotonic() + timeout
        while not all(p.get_subscription_count() for p in publishers):
            assert time.monotonic() < end, "nobody subscribes"
            threading.Event().wait(0.02)

    def look(self, seconds=3.0, hand_from=1.6):
        """Publish a camera that sees a hand point at lemon 1 from some time on."""
        self.connected([self.rgb, self.depth, self.info, self.hands, self.tf, self.command])
        transform = StampedTransform(self.start_s, "base_footprint", OPTICAL, POSE)
        self.tf.publish(TFMessage(transforms=[stamped_transform_to_msg(transform)]))
        image = np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8)
        for t in np.arange(0.0, seconds, 0.125):
            header = header_to_msg(self.start_s + t, OPTICAL)
            self.info.publish(camera_to_msg(CAMERA, header))
            self.rgb.publish(rgb_to_msg(image, header))
            self.depth.publish(depth_to_msg(np.ones((CAMERA.height, CAMERA.width), np.float32), header))
            there = pointing((0.6, 0.1, TABLE_Z + 0.02), (0.75, 0.2, 0.9), np.array([self.start_s + t]))[0]
            msg = hands_to_msg(there)
            msg.header.frame_id = OPTICAL
            if t < hand_from:
                msg.hands, msg.pointing_hand = [], -1
            self.hands.publish(msg)
            threading.Event().wait(0.03)  # a camera does not send its images all at once

    def say(self, cmd: Command):
        self.command.publish(command_to_msg(cmd, self.start_s))


@pytest.fixture(name="context")
def _context():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    yield context
    rclpy.try_shutdown(context=context)


class Graph:
    """A reasoner with its surroundings, spinning."""

    def __init__(self, context, *, detector=True, **parameters):
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.reasoner = ReasonerNode(context=context, parameter_overrides=overrides)
        self.world = Surroundings(context, detector)
        self.executor = MultiThreadedExecutor(num_threads=4, context=context)
        self.executor.add_node(self.reasoner)
        self.executor.add_node(self.world.node)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self.world

    def __exit__(self, *_):
        self.executor.shutdown(timeout_sec=5.0)
        self.thread.join(5.0)
        self.world.node.destroy_node()
        self.reasoner.destroy_node()


def lemon_to_bowl(start):
    return command(
        reference("lemon", start + 1.7, start + 2.0), reference("bowl", start + 2.2, start + 2.3), text="take the lemon"
    )


def test_a_command_with_a_gesture_is_grounded_explained_and_drawn(context):
    with Graph(context) as world:
        world.look()
        world.say(lemon_to_bowl(world.start_s))
        msg = world.wait("/uncom/grounded_command")
        assert (msg.status, msg.object.id, msg.target.object.id) == (GroundedCommand.GROUNDED, "lemon_1", "bowl_1")
        assert msg.header.frame_id == "base_footprint"
        assert msg.target.pose.position.z > TABLE_Z
        assert world.wait("/uncom/explanation").utterance_id == "u1"
        assert world.wait("/uncom/annotated").width == 2 * CAMERA.width + 4
        assert world.wait("/uncom/say").data == "I take the lemon and put it in the bowl."
        request = world.requests[0]
        stamp = request.image.header.stamp.sec + 1e-9 * request.image.header.stamp.nanosec - world.start_s
        assert stamp < 1.6 - 0.7  # the scene is looked at before the hand came in
        assert len(request.hands.hands) == 0
        assert request.has_transform
        assert len(request.depth.data) > 0
        assert request.phrases == ["lemon", "bowl", "container", "objects"]


def test_what_is_no_command_ends_in_a_polite_failure_and_the_next_one_works(context):
    with Graph(context) as world:
        world.look()
        world.say(Command("u0", Act.REFUSED, "hello there", reason="I heard no command."))
        assert world.wait("/uncom/grounded_command").reason == "I heard no command."
        world.say(command(reference("pear", world.start_s + 1.0, world.start_s + 1.2)))
        assert world.wait("/uncom/grounded_command", 2).reason == "I do not see the pear on the table."
        world.say(lemon_to_bowl(world.start_s))
        assert world.wait("/uncom/grounded_command", 3).status == GroundedCommand.GROUNDED


def test_stop_is_passed_on_at_once(context):
    with Graph(context) as world:
        world.connected([world.command])
        world.say(Command("u0", Act.STOP, "stop"))
        world.wait("/uncom/stop")


def test_without_a_detector_the_person_is_told(context):
    with Graph(context, detector=False, detect_timeout_s=0.5) as world:
        world.look()
        world.say(lemon_to_bowl(world.start_s))
        assert "detector" in world.wait("/uncom/grounded_command").reason


def test_without_images_the_person_is_told(context):
    with Graph(context, wait_timeout_s=0.3) as world:
        world.connected([world.command])
        world.say(lemon_to_bowl(world.start_s - 5.0))
        assert world.wait("/uncom/grounded_command").reason == "I see nothing: no camera images arrive."


# --- questions, answers, consent ---------------------------------------------------------------------------------


def two_lemons(start, utterance="u1"):
    """A command that leaves open which lemon: nobody points around its words."""
    obj = reference("lemon", start + 0.2, start + 0.5)
    return replace(
        command(obj, reference("bowl", start + 0.6, start + 0.8), text="put the lemon in the bowl"),
        utterance_id=utterance,
    )


def asked(world, count=1):
    world.look(seconds=1.5, hand_from=9.0)
    world.say(two_lemons(world.start_s))
    return world.wait("/uncom/question", count)


def test_a_doubt_becomes_a_question_and_its_spoken_answer_a_command(context):
    with Graph(context) as world:
        question = asked(world)
        assert question.kind == Question.GROUNDING
        assert set(question.candidate_ids) == {"lemon_1", "lemon_2"}
        assert world.wait("/uncom/grounded_command").status == GroundedCommand.AMBIGUOUS
        assert world.wait("/uncom/say").data == question.text
        wanted = question.choices[list(question.candidate_ids).index("lemon_2")]
        obj = reference(wanted.removeprefix("the "), world.start_s + 3, world.start_s + 4)
        world.say(Command("u2", Act.FRAGMENT, wanted, object=obj))
        msg = world.wait("/uncom/grounded_command", 2)
        assert (msg.status, msg.object.id, msg.utterance_id) == (GroundedCommand.GROUNDED, "lemon_2", "u1")


def test_whoever_plays_a_bag_is_told_that_all_is_done_though_a_question_is_open(context):
    with Graph(context) as world:
        settle = world.node.create_client(Trigger, "/reasoner_node/settle")
        asked(world)
        assert settle.wait_for_service(timeout_sec=20.0)
        for _ in range(50):  # decisions take a few of these at most
            done = threading.Event()
            future = settle.call_async(Trigger.Request())
            future.add_done_callback(lambda _, done=done: done.set())
            assert done.wait(20.0)
            if future.result().success:
                break
        assert future.result().success


def test_a_hand_answers_a_question(context):
    with Graph(context) as world:
        asked(world)
        world.connected([world.hands])
        while len(world.received["/uncom/grounded_command"]) < 2 and time.time() < world.start_s + 12.0:
            there = pointing((0.6, 0.1, TABLE_Z + 0.02), (0.75, 0.2, 0.9), np.array([time.time()]))[0]
            world.hands.publish(hands_to_msg(there))
            threading.Event().wait(0.1)
        msg = world.wait("/uncom/grounded_command", 2)
        assert (msg.status, msg.object.id) == (GroundedCommand.GROUNDED, "lemon_1")


def test_a_message_answers_a_question_and_one_to_another_question_does_not(context):
    with Graph(context) as world:
        question = asked(world)
        world.answer.publish(Answer(question_id="another", answer=Answer.CHOICE, choice=0))
        world.answer.publish(Answer(question_id=question.question_id, answer=Answer.UNKNOWN))
        world.answer.publish(Answer(question_id=question.question_id, answer=Answer.CHOICE, choice=1))
        msg = world.wait("/uncom/grounded_command", 2)
        assert msg.object.id == question.candidate_ids[1]


def test_a_question_without_an_answer_ends_and_the_next_command_works(context):
    with Graph(context, question_timeout_s=0.5) as world:
        asked(world)
        msg = world.wait("/uncom/grounded_command", 2)
        assert msg.status == GroundedCommand.CANCELLED
        world.say(replace(command(reference("bowl", world.start_s + 0.2, world.start_s + 0.5)), utterance_id="u9"))
        assert world.wait("/uncom/grounded_command", 3).status == GroundedCommand.GROUNDED


def test_a_correction_takes_back_the_last_command_and_gives_another(context):
    with Graph(context) as world:
        world.look()
        world.say(lemon_to_bowl(world.start_s))
        assert world.wait("/uncom/grounded_command").object.id == "lemon_1"
        other = reference("one", world.start_s + 4, world.start_s + 4.3, other=True, concrete=False)
        world.say(Command("u2", Act.CORRECTION, "no, the other one", object=other))
        assert world.wait("/uncom/grounded_command", 2).status == GroundedCommand.CANCELLED
        msg = world.wait("/uncom/grounded_command", 3)
        assert (msg.status, msg.object.id) == (GroundedCommand.GROUNDED, "lemon_2")


def awaiting(world):
    world.connected([world.status, world.command, world.answer])
    world.status.publish(ExecutionStatus(utterance_id="u1", index=0, stage=ExecutionStatus.AWAITING_APPROVAL))
    return world.wait("/uncom/question")


@pytest.mark.parametrize(("act", "verdict"), [(Act.YES, Answer.YES), (Act.NO, Answer.NO), (Act.STOP, Answer.NO)])
def test_consent_is_asked_for_once_and_only_a_spoken_yes_is_one(context, act, verdict):
    """R1."""
    with Graph(context) as world:
        question = awaiting(world)
        assert (question.kind, question.question_id) == (Question.APPROVAL, "approve-u1-0")
        world.say(Command("u2", Act.REFUSED, "yes yes maybe", reason="?"))
        world.wait("/uncom/grounded_command")
        assert "/uncom/answer" not in world.received  # what was not understood is no answer
        world.say(Command("u3", act, "?"))
        answer = world.wait("/uncom/answer")
        assert (answer.question_id, answer.answer) == ("approve-u1-0", verdict)


def test_consent_by_service(context):
    with Graph(context) as world:
        awaiting(world)
        assert world.approve.wait_for_service(10.0)
        world.approve.call_async(SetBool.Request(data=True))
        assert world.wait("/uncom/answer").answer == Answer.YES


def test_consent_that_does_not_come_is_a_no(context):
    with Graph(context, approval_timeout_s=0.4) as world:
        awaiting(world)
        assert world.wait("/uncom/answer").answer == Answer.NO


def test_an_approval_question_of_the_execution_node_is_not_asked_twice(context):
    with Graph(context) as world:
        world.connected([world.question, world.status])
        world.question.publish(Question(question_id="approve-u1-0", utterance_id="u1", text="May I take it?"))
        assert world.wait("/uncom/say").data == "May I take it?"
        world.status.publish(ExecutionStatus(utterance_id="u1", index=0, stage=ExecutionStatus.AWAITING_APPROVAL))
        world.say(Command("u2", Act.YES, "yes"))
        assert world.wait("/uncom/answer").answer == Answer.YES
        assert len(world.received["/uncom/question"]) == 1


# --- nothing stalls ------------------------------------------------------------------------------------------------


def test_a_detector_that_fails_once_fails_one_command_only(context):
    with Graph(context) as world:
        world.look()
        world.broken = True
        world.say(lemon_to_bowl(world.start_s))
        assert world.wait("/uncom/grounded_command").reason == "I cannot look at the table: the lens is covered"
        world.broken = False
        world.say(lemon_to_bowl(world.start_s))
        assert world.wait("/uncom/grounded_command", 2).status == GroundedCommand.GROUNDED


def test_a_command_without_any_times_or_parts_stalls_nothing(context):
    with Graph(context) as world:
        world.look()
        world.command.publish(CommandMsg(utterance_id="x", act=CommandMsg.ACT_COMMAND))
        world.command.publish(CommandMsg(utterance_id="y", act=200, primitive=200))
        assert world.wait("/uncom/grounded_command").status == GroundedCommand.FAILED
        world.say(lemon_to_bowl(world.start_s))
        assert world.wait("/uncom/grounded_command", 2).status == GroundedCommand.GROUNDED


def test_the_table_is_looked_at_while_the_person_still_speaks(context):
    with Graph(context, look_ahead=True) as world:
        world.look(seconds=1.5, hand_from=9.0)
        world.speech.publish(SpeechStatus(state=SpeechStatus.SPEECH))
        end = time.monotonic() + 10.0
        while not world.requests:
            assert time.monotonic() < end, "nothing was looked at"
            threading.Event().wait(0.02)
        world.say(lemon_to_bowl(world.start_s - 1.2))
        world.wait("/uncom/grounded_command")
        first, second = world.requests
        assert list(first.phrases) == ["container", "objects"]
        assert first.image.header.stamp == second.image.header.stamp
