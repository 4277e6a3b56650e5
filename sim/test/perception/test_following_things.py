# SPDX-License-Identifier: Apache-2.0
"""Things over several images: names that stay, things that move, vanish, are hidden; poses from outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, plain_table, takes
from uncom_common.conversions import header_to_msg
from uncom_common.transforms import apply, invert
from uncom_perception.conversions import detection_from_msg, detection_to_msg, models_from_msg, models_to_msg
from uncom_perception.frames import RawBuffer, read_stamp_ns
from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.objects.tracking.external_models import with_models
from uncom_perception.objects.tracking.object_tracker import ObjectTracker
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import ObjectModel
from uncom_sim.pose_estimator.pose_estimator import mesh_of

RED = (0.6, 0.2, 0.08, 0.08, 0.1, (200, 30, 30))
BLUE = (0.65, -0.2, 0.12, 0.06, 0.06, (30, 60, 200))
GREEN = (0.8, 0.0, 0.06, 0.06, 0.05, (40, 150, 60))


@pytest.fixture(scope="module")
def detector():
    return TabletopDetector()


def seen(detector, tracker, blocks, stamp_s, depth=None):
    rgb, z = plain_table(blocks=blocks, seed=int(stamp_s * 10))
    z = z if depth is None else depth(z)
    frame = RgbdFrame(rgb, z, CAMERA, POSE, stamp_s=stamp_s)
    return tracker.update(detector.detect(frame, []), frame)


def tracks(scene):
    """Track by the strongest colour of the thing."""
    return {next(a.value for a in d.attributes if a.name == "colour"): d.track for d in scene.detections}


def test_names_stay_from_image_to_image(detector):
    """Three blocks seen three times have three names, all different."""
    tracker = ObjectTracker()
    found = [tracks(seen(detector, tracker, (RED, BLUE, GREEN), 1.0 + i)) for i in range(3)]
    assert found[0] == found[1] == found[2]
    assert len(set(found[0].values())) == 3


def test_what_is_carried_elsewhere_keeps_its_name_and_is_told(detector):
    """A block put somewhere else is the same, by its look; the others have not moved."""
    tracker = ObjectTracker()
    before = tracks(seen(detector, tracker, (RED, BLUE, GREEN), 1.0))
    scene = seen(detector, tracker, ((0.8, 0.35, *RED[2:]), BLUE, GREEN), 2.0)
    assert tracks(scene) == before
    assert scene.moved_tracks == (before["red"],)
    assert scene.vanished_tracks == ()


def test_what_is_taken_away_has_vanished_and_its_name_is_not_given_again(detector):
    """A block that comes later in another colour is a new one."""
    tracker = ObjectTracker()
    before = tracks(seen(detector, tracker, (RED, BLUE), 1.0))
    scene = seen(detector, tracker, (BLUE,), 2.0)
    assert scene.vanished_tracks == (before["red"],)
    after = tracks(seen(detector, tracker, (BLUE, GREEN), 3.0))
    assert after["green"] not in before.values()


def test_what_is_hidden_has_not_vanished(detector):
    """With something before the block, or without depth there, it is not gone; seen again it has its old name."""
    tracker = ObjectTracker()
    before = tracks(seen(detector, tracker, (RED, BLUE), 1.0))

    def arm(depth):
        hidden = depth.copy()
        hidden[:, :330] = 0.5
        return hidden

    def blind(depth):
        hidden = depth.copy()
        hidden[:, :330] = np.nan
        return hidden

    for stamp, cover in ((2.0, arm), (3.0, blind)):
        scene = seen(detector, tracker, (BLUE,), stamp, cover)
        assert before["red"] not in scene.vanished_tracks
    assert tracks(seen(detector, tracker, (RED, BLUE), 4.0)) == before


def test_an_older_image_changes_nothing(detector):
    """It is named by what is known, and nothing moves or vanishes."""
    tracker = ObjectTracker()
    before = tracks(seen(detector, tracker, (RED, BLUE), 5.0))
    old = seen(detector, tracker, (RED,), 4.0)
    assert tracks(old)["red"] == before["red"]
    assert (old.vanished_tracks, old.moved_tracks) == ((), ())
    assert tracks(seen(detector, tracker, (RED, BLUE), 6.0)) == before


def cube(half):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return corners, np.array([[0, 1, 2], [1, 3, 2]])


def model(label, place, score=0.9, mesh=True):
    pose = np.eye(4)
    pose[:3, 3] = place
    vertices, triangles = cube(0.03) if mesh else (np.zeros((0, 3)), np.zeros((0, 3), int))
    return ObjectModel(label, score, pose, vertices, triangles)


@pytest.mark.parametrize("mesh", [True, False])
def test_poses_from_outside_go_to_the_things_they_overlap(detector, mesh):
    """Each model finds its block within 1.5 cm of error; one beside the table belongs to nothing."""
    rgb, depth = plain_table(blocks=(RED, BLUE))
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), [])
    rng = np.random.default_rng(3)
    models = [
        model("blue thing", np.array([0.65, -0.2, 0.75]) + rng.normal(0, 0.005, 3), mesh=mesh),
        model("red thing", np.array([0.6, 0.2, 0.77]) + rng.normal(0, 0.005, 3), mesh=mesh),
        model("stray", (0.3, 0.9, 0.75), mesh=mesh),
    ]
    found = with_models(scene, models, load_lexicon().same)
    names = {tracks_colour(d): d.model.label for d in found.detections}
    assert names == {"red": "red thing", "blue": "blue thing"}


def tracks_colour(detection):
    return next(a.value for a in detection.attributes if a.name == "colour")


def box_mesh(sides):
    """Corners (8, 3) and triangles (12, 3) of a box about the origin."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * sides
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_a_mesh_from_outside_completes_what_is_not_seen(detector, known, seed):
    """Position and size are those of the mesh, without the estimator's error; in the camera's frame, too."""
    rng = np.random.default_rng(9100 + seed)
    sides = np.array([0.08, 0.08, 0.1])
    rgb, depth = plain_table(blocks=(RED,))
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE if known else None), [])
    truth = np.array([0.6, 0.2, 0.77])
    pose = np.eye(4)
    pose[:3, 3] = truth + rng.normal(0.0, 0.006, 3)
    pose = pose if known else invert(POSE) @ pose
    found = with_models(scene, [ObjectModel("box", 0.9, pose, *box_mesh(sides))], load_lexicon().same)
    body = found.detections[0].geometry
    place = body.centroid if known else apply(POSE, body.centroid[None])[0]
    assert place == pytest.approx(truth, abs=0.004)
    assert sorted(body.size) == pytest.approx(sorted(sides), abs=0.004)
    cloud = body.cloud if known else apply(POSE, body.cloud.astype(float))
    behind = cloud[:, 0] > 0.6 + 0.035
    assert (cloud[behind, 2] < 0.8).sum() > 50  # the side that the camera cannot see
    assert not (scene.detections[0].geometry.cloud[:, 0] > 0.635).all()


def test_a_mesh_that_does_not_fit_what_is_seen_changes_nothing(detector):
    """A box twice as large, or without triangles, leaves the thing as it is seen."""
    rgb, depth = plain_table(blocks=(RED,))
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), [])
    pose = np.eye(4)
    pose[:3, 3] = (0.6, 0.2, 0.77)
    corners, triangles = box_mesh(np.array([0.08, 0.08, 0.1]))
    for vertices, faces in ((corners * 1.6, triangles), (corners, triangles[:0])):
        found = with_models(scene, [ObjectModel("box", 0.9, pose, vertices, faces)], load_lexicon().same)
        assert found.detections[0].geometry.size == pytest.approx(scene.detections[0].geometry.size)


@pytest.fixture(scope="module")
def seen_cup(detector):
    """A scene with a cup as it is seen, and the pose (4, 4) of the cup."""
    scene = {"objects": [{"id": "a", "kind": "cup", "x": 0.62, "y": 0.1}], "say": "take this", "point_object": "a"}
    picture = takes(scene, 4)[0]
    pose = np.eye(4)
    pose[:3, 3] = picture.places["a"]
    return detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), []), pose


@pytest.mark.parametrize("inside_out", [False, True])
def test_the_two_sides_of_a_thin_wall_are_told_apart_by_where_the_camera_was(seen_cup, inside_out):
    """Whatever the estimator's error, and whichever way round the corners of the mesh go."""
    scene, pose = seen_cup
    vertices, triangles = mesh_of("cup")
    rng = np.random.default_rng(7)
    for _ in range(8):
        wrong = pose.copy()
        wrong[:3, 3] += rng.normal(0.0, 0.006, 3)
        outside = ObjectModel("cup", 0.9, wrong, vertices, triangles[:, ::-1] if inside_out else triangles)
        (cup,) = with_models(scene, [outside], load_lexicon().same, POSE[:3, 3]).detections
        assert cup.geometry.centroid == pytest.approx(pose[:3, 3], abs=0.002)
        assert cup.geometry.size == pytest.approx((0.084, 0.084, 0.08), abs=0.002)


def test_the_side_that_a_thing_stands_on_is_not_in_its_cloud(seen_cup):
    """The lowest points inside the edge are those of the cup's floor, 6 mm above the table, as they are seen."""
    scene, pose = seen_cup
    outside = ObjectModel("cup", 0.9, pose, *mesh_of("cup"))
    (cup,) = with_models(scene, [outside], load_lexicon().same, POSE[:3, 3]).detections
    inside = np.linalg.norm(cup.geometry.cloud[:, :2] - pose[:2, 3], axis=1) < 0.02
    assert cup.geometry.cloud[inside, 2].min() == pytest.approx(pose[2, 3] - 0.04 + 0.006, abs=0.002)


def test_of_two_models_in_one_place_the_name_decides(detector):
    """A banana by its pixels takes the model that is called a banana."""
    scene = {"objects": [{"id": "a", "kind": "banana", "x": 0.62, "y": 0.0}], "say": "take this", "point_object": "a"}
    picture = takes(scene, 2)[0]
    seen_scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [])
    place = seen_scene.detections[0].geometry.centroid
    models = [model("spoon", place), model("Bananas", place)]
    found = with_models(seen_scene, models, load_lexicon().same)
    assert seen_scene.detections[0].label == "banana"
    assert found.detections[0].model.label == "Bananas"


def test_models_and_tracks_survive_the_way_through_messages(detector):
    """Pose, mesh, label and track come back as they were."""
    rgb, depth = plain_table(blocks=(RED,))
    thing = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), []).detections[0]
    made = replace(thing, track="track_7", model=model("mug", (0.1, 0.2, 0.3)))
    back = detection_from_msg(detection_to_msg(made))
    assert back.track == "track_7"
    assert back.model.pose == pytest.approx(made.model.pose)
    assert back.model.vertices == pytest.approx(made.model.vertices)
    assert np.array_equal(back.model.triangles, made.model.triangles)
    assert detection_from_msg(detection_to_msg(thing)).model is None
    sent = models_to_msg([made.model], header_to_msg(1.0, "base_footprint"), "test")
    again = models_from_msg(sent)[0]
    assert (again.label, again.score) == ("mug", pytest.approx(0.9))
    assert again.pose == pytest.approx(made.model.pose)


def serialized(stamp_ns):
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    return b"\x00\x01\x00\x00" + seconds.to_bytes(4, "little") + rest.to_bytes(4, "little") + b"rest"


def test_the_buffer_gives_the_nearest_picture_that_has_depth():
    """Old ones are dropped; a picture without depth is given only where none has any."""
    buffer = RawBuffer(1.0)
    assert buffer.nearest(1.0) is None
    for tenth in range(30):
        buffer.add_image(serialized(tenth * 100_000_000))
    assert buffer.nearest(2.04).stamp_s == pytest.approx(2.0)
    assert buffer.nearest(0.0).stamp_s == pytest.approx(1.9)
    assert buffer.nearest(2.04).depth is None
    buffer.add_depth(serialized(2_500_000_000))
    assert buffer.nearest(2.04).stamp_s == pytest.approx(2.5)
    assert read_stamp_ns(buffer.nearest(2.04).depth) == 2_500_000_000
    buffer.add_image(serialized(100_000_000))
    assert buffer.nearest(2.0).stamp_s == pytest.approx(0.1)
