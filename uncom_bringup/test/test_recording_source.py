# SPDX-License-Identifier: Apache-2.0
"""A recording played into a session's memory, with a detector made for the test."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from uncom_bringup.chain.config import ChainConfig
from uncom_bringup.chain.recording import CameraFrame
from uncom_bringup.chain.recording_source import RecordingClock, RecordingSource
from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import UncomError
from uncom_common.transforms import StampedTransform
from uncom_language.types import Act, Command, Reference, Span
from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.scene_detector import OutsidePoses, SceneDetector
from uncom_perception.types import Box, Detection, Geometry, HandsFrame, ObjectModel, Scene
from uncom_reasoner.evidence.frame_buffer import SceneFrame
from uncom_reasoner.session.events import Report
from uncom_reasoner.session.session import Session
from uncom_reasoner.session.synchronous import run_tasks
from uncom_reasoner.session.task import DetectionRequest
from uncom_reasoner.types import Evidence, Status, View
from uncom_reasoner.weights import load_weights

CAMERA = PinholeCamera(64, 48, 50.0, 50.0, 32.0, 24.0)
POSE = np.array([[0.0, -1.0, 0.0, 0.6], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.7], [0.0, 0.0, 0.0, 1.0]])
PLACE = np.array([0.6, 0.1, 0.75])


class OneMug(ObjectDetector):
    """Sees one mug, whatever the image, in the frame that it is given."""

    def __init__(self):
        self.calls = []

    @property
    def name(self):
        return "made"

    def detect(self, frame, phrases, hands=None):
        self.calls.append((frame.stamp_s, tuple(phrases), hands, frame.depth is not None))
        rng = np.random.default_rng(0)
        pose = np.eye(4)
        pose[:3, 3] = PLACE
        cloud = PLACE + rng.uniform(-0.04, 0.04, (200, 3))
        mask = np.zeros((48, 64), bool)
        mask[20:30, 20:30] = True
        body = Geometry(PLACE, pose, np.full(3, 0.08), cloud.astype(np.float32))
        mug = Detection("d0", "mug", 0.9, Box(20, 20, 30, 30), mask, body, phrase_scores=(0.95,) * len(phrases))
        return Scene(frame.stamp_s, frame.frame_id, (mug,), None, (0.05,) * len(phrases), "made")


@dataclass
class MadeRecording:
    """Images of three seconds, the camera above the table."""

    object_poses: tuple[OutsidePoses, ...] = ()
    samples: np.ndarray = None
    sample_rate: int = 16000
    sound_start_s: float = 0.0
    camera: PinholeCamera = CAMERA
    camera_frame: str = "optical"

    @property
    def transforms(self):
        return [(StampedTransform(0.0, "base_footprint", "optical", POSE), True)]

    def frames(self):
        for stamp_s in np.arange(0.0, 3.0, 0.125):
            yield CameraFrame(float(stamp_s), np.zeros((48, 64, 3), np.uint8), np.ones((48, 64), np.float32))


def source_of(recording, detector, hands=(), known=()):
    config = ChainConfig()
    session = Session(config.reasoner, load_weights(), RecordingClock())
    scenes = SceneDetector(detector, lambda a, b: a == b, track=False)
    return session, RecordingSource(recording, hands, session.memory, scenes, config, known)


def no_hands():
    return [HandsFrame(float(t), "optical", 64, 48, ()) for t in np.arange(0.0, 3.0, 0.125)]


def take_the_mug():
    return Command("u1", Act.COMMAND, "take the mug", "take", object=Reference("mug", "mug", Span(1.0, 1.5)))


def test_images_and_hands_come_up_to_the_time_that_is_asked_for_and_go_on_from_there():
    session, source = source_of(MadeRecording(), OneMug(), no_hands())
    source.play_until(1.05)
    assert (session.memory.images.latest_s(), session.memory.hands.latest_s()) == (1.125, 1.125)
    source.play_until(0.5)
    assert session.memory.images.latest_s() == 1.125
    source.play_until(9.0)
    assert session.memory.images.latest_s() == 2.875


def test_a_command_on_a_recording_is_decided_without_any_wait():
    session, source = source_of(MadeRecording(), OneMug(), no_hands())
    source.play_until(2.1)
    session.hear(take_the_mug())
    (report,) = [event for event in run_tasks(session, source.detect) if isinstance(event, Report)]
    assert (report.decision.grounded.status, report.decision.grounded.object.id) == (Status.GROUNDED, "d0")
    assert report.decision.grounded.frame_id == "base_footprint"


REQUEST = DetectionRequest(SceneFrame(1.0, with_hand=True), ("mug",))


def test_a_scene_that_is_known_for_the_same_phrases_is_not_detected_again():
    detector = OneMug()
    _, source = source_of(MadeRecording(), detector, no_hands())
    source.play_until(2.0)
    scene = source.detect(REQUEST)
    known = Evidence(take_the_mug(), scene, ("mug",), View())
    _, again = source_of(MadeRecording(), detector, no_hands(), [known])
    again.play_until(2.0)
    assert again.detect(REQUEST) is scene
    again.detect(DetectionRequest(REQUEST.frame, ("mug", "bowl")))
    assert [phrases for _, phrases, _, _ in detector.calls] == [("mug",), ("mug", "bowl")]


def test_hands_go_to_the_detector_only_where_they_are_in_the_frame():
    detector = OneMug()
    _, source = source_of(MadeRecording(), detector, no_hands())
    source.play_until(2.0)
    source.detect(REQUEST)
    source.detect(DetectionRequest(SceneFrame(1.0, with_hand=False), ("mug",)))
    assert [hands is None for _, _, hands, _ in detector.calls] == [False, True]


def test_an_image_that_was_not_played_yet_is_refused():
    _, source = source_of(MadeRecording(), OneMug())
    with pytest.raises(UncomError, match="no image"):
        source.detect(REQUEST)


def outside(frame_id, pose, stamp_s=1.0):
    empty = ObjectModel("mug", 0.9, pose, np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    return OutsidePoses(stamp_s, frame_id, (empty,))


@pytest.mark.parametrize(
    ("poses", "matched"),
    [
        ((), False),
        ((outside("base_footprint", np.eye(4)), outside("base_footprint", np.eye(4), 0.2)), True),
        ((outside("optical", np.linalg.inv(POSE)),), True),
        ((outside("map", np.eye(4)),), False),
        ((outside("base_footprint", np.eye(4), stamp_s=0.0),), False),
    ],
)
def test_outside_poses_of_about_the_same_time_reach_the_objects_in_either_frame(poses, matched):
    at_the_mug = np.eye(4)
    at_the_mug[:3, 3] = PLACE
    placed = tuple(replace(p, models=tuple(replace(m, pose=m.pose @ at_the_mug) for m in p.models)) for p in poses)
    _, source = source_of(MadeRecording(object_poses=placed), OneMug(), no_hands())
    source.play_until(2.0)
    (mug,) = source.detect(REQUEST).detections
    assert (mug.model is not None) == matched
    if matched:
        assert np.allclose(mug.model.pose, at_the_mug)
