# SPDX-License-Identifier: Apache-2.0
"""The tabletop detector on rendered scenes and on tables made of numbers."""

from __future__ import annotations

import json

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, camera_pose, overlap, plain_table, takes
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.hands import point_in_image
from uncom_perception.objects import detect_in_image, scene_to_json
from uncom_perception.objects.detectors.detect_in_image import own_fits
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.rgbd_frame import RgbdFrame

KINDS = [
    "banana",
    "apple",
    "lemon",
    "orange",
    "pear",
    "mug",
    "cup",
    "bowl",
    "plate",
    "box",
    "cereal box",
    "can",
    "spoon",
]
SCENES = [
    {
        "objects": [
            {"id": "a", "kind": "banana", "x": 0.58, "y": 0.3, "yaw": 0.7},
            {"id": "b", "kind": "bowl", "colour": "red", "x": 0.6, "y": -0.02},
            {"id": "c", "kind": "mug", "colour": "blue", "x": 0.62, "y": -0.27, "yaw": 1.2},
            {"id": "d", "kind": "spoon", "x": 0.78, "y": 0.1, "yaw": 1.3},
            {"id": "e", "kind": "can", "colour": "green", "x": 0.82, "y": -0.15},
        ],
        "say": "take this banana and put it in this bowl",
        "point_object": "a",
        "point_target": "b",
    },
    {
        "objects": [
            {"id": "a", "kind": "lemon", "x": 0.56, "y": 0.26},
            {"id": "b", "kind": "plate", "x": 0.65, "y": 0.0},
            {"id": "c", "kind": "orange", "x": 0.58, "y": -0.24},
            {"id": "d", "kind": "bottle", "colour": "purple", "x": 0.8, "y": 0.25},
            {"id": "e", "kind": "cereal box", "colour": "yellow", "x": 0.8, "y": -0.25, "yaw": 1.4},
        ],
        "say": "take this lemon and put it on this plate",
        "point_object": "a",
        "point_target": "b",
    },
]


@pytest.fixture(scope="module")
def pictures():
    return [take for i, scene in enumerate(SCENES) for take in takes(scene, 5 + i, (None, "object"))]


@pytest.fixture(scope="module")
def detector():
    return TabletopDetector()


def test_everything_on_the_table_is_found_and_nothing_else(pictures, detector):
    """Without a person each visible thing has one mask that overlaps it by more than half, and there are no others."""
    for picture in pictures[::2]:
        scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [])
        for name, mask in picture.masks.items():
            assert max(overlap(d.mask, mask) for d in scene.detections) > 0.6, picture.kinds[name]
        assert len(scene.detections) == len(picture.masks)


@pytest.mark.parametrize("seed", range(3))
def test_a_round_fruit_is_one_thing_wherever_it_lies_though_it_has_a_dent_and_a_stem(detector, seed):
    places = [(0.5, 0.23), (0.55, -0.3), (0.55, 0.0), (0.7, 0.3), (0.75, -0.1), (0.85, 0.1), (0.85, -0.3)]
    fruit = [
        {"id": f"f{i}", "kind": ("apple", "orange")[(i + seed) % 4 == 3], "x": x, "y": y, "yaw": 0.9 * i + seed}
        for i, (x, y) in enumerate(places)
    ]
    words = {"say": "take this and put it next to this", "point_object": "f0", "point_target": "f1"}
    (picture,) = takes({"objects": fruit, **words}, 70 + seed, (None,))
    scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [])
    assert len(scene.detections) == len(fruit)
    for mask in picture.masks.values():
        assert max(overlap(d.mask, mask) for d in scene.detections) > 0.7


@pytest.mark.parametrize("turn", [0.0, 0.4, 0.8])
def test_a_mug_is_one_thing_wherever_its_handle_points(detector, turn):
    """Its handle folds out of its wall, and its inside is parted from its front by the rim."""
    places = [(0.55, -0.3), (0.55, 0.0), (0.55, 0.3), (0.8, -0.3), (0.8, 0.0), (0.8, 0.3)]
    mugs = [
        {
            "id": f"m{i}",
            "kind": "mug",
            "colour": ("green", "blue", "red")[i % 3],
            "x": x,
            "y": y,
            "yaw": turn + 1.05 * i,
        }
        for i, (x, y) in enumerate(places)
    ]
    words = {"say": "take this mug and put it next to this mug", "point_object": "m0", "point_target": "m1"}
    (picture,) = takes({"objects": mugs, **words}, 31, (None,))
    scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), ["mug"])
    assert len(scene.detections) == len(mugs)
    for mask in picture.masks.values():
        assert max(overlap(d.mask, mask) for d in scene.detections) > 0.7


def test_a_named_thing_comes_first(pictures, detector):
    """The noun of each thing fits that thing best."""
    for picture in pictures[::2]:
        names = list(picture.masks)
        scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [picture.kinds[n] for n in names])
        for i, name in enumerate(names):
            best = max(scene.detections, key=lambda d: d.phrase_scores[i])
            assert overlap(best.mask, picture.masks[name]) > 0.5, picture.kinds[name]


@pytest.mark.parametrize("light", [0.3, 0.6, 1.0, 1.15])
def test_colours_and_things_stay_in_dim_and_in_glaring_light(pictures, detector, light):
    """A lamp that is turned down or up changes no thing's colour."""
    for picture in pictures[::2]:
        rgb = np.clip(picture.rgb * light, 0, 255).astype(np.uint8)
        scene = detector.detect(RgbdFrame(rgb, picture.depth, CAMERA, POSE), [])
        assert len(scene.detections) == len(picture.masks)
        for name, mask in picture.masks.items():
            if picture.kinds[name] == "spoon":  # polished metal is grey to some, white to others
                continue
            found = max(scene.detections, key=lambda d: overlap(d.mask, mask)).attributes
            assert next(a.value for a in found if a.name == "colour") == picture.colours[name], picture.kinds[name]


def test_probabilities_of_a_phrase_and_of_none_sum_to_one(pictures, detector):
    """Also for words that fit nothing, or that nobody knows."""
    phrases = ["banana", "red bowl", "the biggest container", "objects", "flurble", "table", ""]
    scene = detector.detect(RgbdFrame(pictures[0].rgb, pictures[0].depth, CAMERA, POSE), phrases)
    for i, none in enumerate(scene.phrase_none):
        assert sum(d.phrase_scores[i] for d in scene.detections) + none == pytest.approx(1.0, abs=1e-6)
    assert scene.phrase_none[phrases.index("table")] == 1.0
    assert scene.phrase_none[phrases.index("banana")] < 0.3


def test_hand_and_forearm_are_no_things(pictures, detector):
    """With a person pointing, no detection lies on the hand."""
    for picture in pictures[1::2]:
        hands = point_in_image(picture.rgb, picture.depth, CAMERA)
        scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [], hands)
        for d in scene.detections:
            assert (d.mask & picture.hand_mask).sum() < 0.3 * d.mask.sum()


def test_boxes_stand_where_things_stand(pictures, detector):
    """Centroids are within 2 cm of the truth on the floor plan, clouds lie above the table."""
    picture = pictures[0]
    scene = detector.detect(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), [])
    for name, mask in picture.masks.items():
        d = max(scene.detections, key=lambda d: overlap(d.mask, mask))
        if picture.kinds[name] in ("mug", "banana"):  # their frame is not their middle
            continue
        assert np.linalg.norm(d.geometry.centroid[:2] - picture.places[name][:2]) < 0.02
        assert d.geometry.cloud[:, 2].min() > 0.71
        assert len(d.geometry.cloud) > 20


def test_the_table_is_outlined_where_things_and_the_border_hide_it():
    """A table whose corners are out of sight or covered is still the rectangle it is."""
    blocks = [(0.92, 0.45, 0.1, 0.1, 0.12, (200, 30, 30)), (0.5, -0.4, 0.1, 0.2, 0.1, (30, 60, 200))]
    rgb, depth = plain_table(blocks=blocks)
    scene = TabletopDetector().detect(RgbdFrame(rgb, depth, CAMERA, POSE), [])
    polygon = scene.table.polygon
    assert polygon.min(axis=0)[:2] == pytest.approx([0.45, -0.5], abs=0.015)
    assert polygon.max(axis=0)[:2] == pytest.approx([0.95, 0.5], abs=0.015)
    assert scene.table.height_m == pytest.approx(0.72, abs=0.004)
    area = 0.5 * np.sum(polygon[:, 0] * np.roll(polygon[:, 1], -1) - np.roll(polygon[:, 0], -1) * polygon[:, 1])
    assert area > 0.0  # counter-clockwise from above


@pytest.mark.parametrize(("height", "pitch"), [(0.5, 0.8), (0.72, 0.95), (0.9, 0.7)])
def test_any_table_height_and_camera_pitch_will_do(height, pitch):
    """Blocks of known size are measured right at other heights and angles, in the camera's own frame too."""
    pose = camera_pose(pitch, (0.0, 0.0, height + 0.75))
    rgb, depth = plain_table(height, blocks=[(0.6, 0.1, 0.1, 0.06, 0.08, (200, 30, 30))], pose=pose)
    for known in (pose, None):
        scene = TabletopDetector().detect(RgbdFrame(rgb, depth, CAMERA, known), ["red box"])
        assert len(scene.detections) == 1
        assert sorted(scene.detections[0].geometry.size) == pytest.approx([0.06, 0.08, 0.1], abs=0.012)
        place = scene.detections[0].geometry.centroid
        if known is None:
            place = pose[:3, :3] @ place + pose[:3, 3]
        assert place == pytest.approx([0.6, 0.1, height + 0.04], abs=0.015)


def test_without_a_table_there_is_an_empty_scene():
    """A wall, or depth with nothing in it, gives no table and no things; it is no error."""
    rgb = np.full((480, 640, 3), 128, np.uint8)
    for depth in (np.full((480, 640), np.nan, np.float32), np.full((480, 640), 3.0, np.float32)):
        scene = TabletopDetector().detect(RgbdFrame(rgb, depth, CAMERA, POSE), ["bowl"])
        assert scene.table is None
        assert scene.detections == ()
        assert scene.phrase_none == (1.0,)


def test_without_depth_the_picture_alone_serves(pictures):
    """Most things are found by colour, with lower scores, and the answer says so."""
    picture = pictures[0]
    scene = detect_in_image(RgbdFrame(picture.rgb), "objects")
    assert "without depth" in scene.backend
    assert all(d.geometry is None and d.score <= 0.5 for d in scene.detections)
    found = [max((overlap(d.mask, m) for d in scene.detections), default=0.0) > 0.5 for m in picture.masks.values()]
    assert sum(found) >= 3


def test_the_json_holds_what_the_command_line_promises(pictures):
    """Detections best first, table as a polygon; "table" gives the table itself."""
    picture = pictures[0]
    for phrase in ("bowl", "objects", "table", "the biggest thing"):
        data = json.loads(
            json.dumps(scene_to_json(detect_in_image(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), phrase)))
        )
        assert set(data) == {"detections", "table", "backend"}
        scores = [d["score"] for d in data["detections"]]
        assert scores == sorted(scores, reverse=True)
        assert scores
        assert len(data["table"]) >= 3
        assert set(data["detections"][0]) == {"label", "score", "box", "centroid_m", "size_m"}


def test_scores_are_what_each_thing_is_by_itself(pictures):
    """Whoever asks for what nobody knows gets a weak score for all, not a good one for being one of many."""
    picture = pictures[0]
    for phrase, least, most in (("unicorn", 0.1, 0.35), ("objects", 0.8, 1.0), ("bowl", 0.6, 1.0)):
        scene = detect_in_image(RgbdFrame(picture.rgb, picture.depth, CAMERA, POSE), phrase)
        assert least <= scene.detections[0].score <= most, phrase
    fits = [0.7, 0.2, 0.05, 0.0]
    none = float(np.prod(1.0 - np.array(fits)))
    assert own_fits([f / sum(fits) * (1.0 - none) for f in fits], none) == pytest.approx(fits, abs=1e-6)
    assert own_fits([0.0], 1.0) == [0.0]
    assert own_fits([], 1.0) == []


def test_images_that_do_not_fit_together_are_refused(detector):
    """Depth of another size is an error that names both sizes."""
    with pytest.raises(InvalidImageError, match="320, 240"):
        detector.detect(
            RgbdFrame(np.zeros((480, 640, 3), np.uint8), np.zeros((240, 320), np.float32), CAMERA, POSE), []
        )
