# SPDX-License-Identifier: Apache-2.0
"""What real depth cameras do: noise that grows with distance, a bowed picture, holes, shiny floors, stacks, floors."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, camera_pose, overlap, plain_table
from uncom_perception.objects import detect_in_image
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.objects.table.depth_cleaning import without_pinholes
from uncom_perception.rgbd_frame import RgbdFrame

BLOCKS = [
    (0.6, 0.2, 0.08, 0.08, 0.1, (200, 30, 30)),
    (0.65, -0.2, 0.12, 0.06, 0.06, (30, 60, 200)),
    (0.8, 0.05, 0.06, 0.06, 0.05, (40, 150, 60)),
]


@pytest.fixture(scope="module")
def detector():
    return TabletopDetector()


def as_sensed(depth, seed, noise_m=0.003, bow_m=0.0, millimetres=True):
    """Give correlated noise that grows with the square of distance, a bow, holes at edges, and whole millimetres."""

    rng = np.random.default_rng(seed)
    v, u = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]]
    grain = cv2.GaussianBlur(rng.normal(0.0, 1.0, depth.shape), (0, 0), 2.0) * 5.0
    sensed = depth + grain * noise_m * depth**2
    x, y = u / depth.shape[1] - 0.5, v / depth.shape[0] - 0.5
    sensed = sensed + bow_m * (x**2 + y**2) * 4.0
    jump = cv2.dilate(depth, np.ones((5, 5))) - cv2.erode(depth, np.ones((5, 5)))
    sensed[jump > 0.02 * depth] = np.nan
    return np.round(sensed, 3 if millimetres else 9).astype(np.float32)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("noise_m", "bow_m"), [(0.001, 0.0), (0.0025, 0.0), (0.001, 0.012)])
def test_noise_and_a_bowed_picture_make_no_things(detector, seed, noise_m, bow_m):
    """Three blocks are three things, found where they are, and the noisy table is none."""
    rgb, depth = plain_table(blocks=BLOCKS, noise_m=0.0)
    scene = detector.detect(RgbdFrame(rgb, as_sensed(depth, seed, noise_m, bow_m), CAMERA, POSE), [])
    assert len(scene.detections) == 3
    for x, y, *_ in BLOCKS:
        assert min(np.hypot(*(d.geometry.centroid[:2] - (x, y))) for d in scene.detections) < 0.03


def test_what_shines_is_whole_although_its_depth_is_that_of_the_table(detector):
    """The middle of a white block, whose depth says table, belongs to it by its colour."""
    x, y, w, h = 0.65, 0.0, 0.16, 0.16
    rgb, depth = plain_table(blocks=[(x, y, w, h, 0.05, (240, 240, 238))])
    truth = np.all(rgb == (240, 240, 238), axis=2)
    bare = plain_table()[1]
    v, u = np.nonzero(truth)
    hole = np.zeros_like(truth)
    hole[int(np.percentile(v, 30)) : int(np.percentile(v, 75)), int(u.min() + 12) : int(u.max() - 12)] = True
    depth[hole & truth] = bare[hole & truth]
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), [])
    assert len(scene.detections) == 1
    assert overlap(scene.detections[0].mask, truth) > 0.85


def test_things_of_one_colour_on_one_another_are_two(detector):
    """A tall box on a wide one meets it in a sharp fold."""
    grey = (150, 150, 155)
    rgb, depth = plain_table(blocks=[(0.65, 0.0, 0.22, 0.22, 0.06, grey), (0.65, 0.0, 0.08, 0.08, 0.2, grey)])
    scene = detector.detect(RgbdFrame(rgb, as_sensed(depth, 3, 0.001), CAMERA, POSE), [])
    heights = sorted(d.geometry.size[2] for d in scene.detections)
    assert len(scene.detections) == 2
    assert heights[0] == pytest.approx(0.06, abs=0.015)


def test_a_step_in_depth_without_colour_is_no_thing(detector):
    """A dent of a few millimetres on the bare table is the sensor's."""
    rgb, depth = plain_table(noise_m=0.0005)
    depth[200:230, 300:340] -= 0.006
    assert detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), []).detections == ()
    rgb[200:230, 300:340] = (30, 30, 35)
    assert len(detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), []).detections) == 1


@pytest.mark.parametrize("seed", range(4))
def test_of_table_and_floor_the_table_is_taken_without_a_camera_pose(seed):
    """Also where more of the floor than of the table is in view."""
    pose = camera_pose(0.75, (-0.35, 0.0, 1.5))
    rgb, depth = plain_table(blocks=BLOCKS, pose=pose, seed=seed)
    scene = detect_in_image(RgbdFrame(rgb, depth, CAMERA), "objects")
    assert scene.table is not None
    camera_height = abs(float(scene.table.normal @ scene.table.polygon[0]))
    assert camera_height == pytest.approx(1.5 - 0.72, abs=0.02)
    assert len(scene.detections) == 3


@pytest.mark.parametrize("roll", [-90, -30, 30, 90, 180])
def test_a_camera_held_any_way_up_sees_the_same(roll):
    """Where its pose is not known, the table is below what stands on it on the camera's side."""
    turn = np.eye(4)
    c, s = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    turn[:2, :2] = [[c, -s], [s, c]]
    pose = camera_pose(0.95) @ turn
    pose[:3, 3] = (0.3, 0.0, 1.35)
    rgb, depth = plain_table(blocks=BLOCKS, pose=pose, seed=9100)
    scene = detect_in_image(RgbdFrame(rgb, depth, CAMERA), "objects")
    assert len(scene.detections) == 3
    up = pose[:3, :3] @ scene.table.normal
    assert up == pytest.approx([0.0, 0.0, 1.0], abs=0.02)
    heights = sorted(float(d.geometry.size[2]) for d in scene.detections)
    assert heights == pytest.approx([0.05, 0.06, 0.1], abs=0.01)


@pytest.mark.parametrize("share", [0.15, 0.3, 0.6])
def test_pixels_that_are_lost_all_over_the_picture_do_no_harm(detector, share):
    """What is about them tells what they are; a wide shadow stays unknown."""
    rgb, depth = plain_table(blocks=BLOCKS)
    lost = np.random.default_rng(9101).random(depth.shape) < share
    scene = detector.detect(RgbdFrame(rgb, np.where(lost, np.float32(np.nan), depth), CAMERA, POSE), [])
    assert len(scene.detections) == 3
    for *_, colour in BLOCKS:
        assert max(overlap(d.mask, np.all(rgb == colour, axis=2)) for d in scene.detections) > 0.8
    depth[100:200, 300:400] = np.nan
    assert without_pinholes(depth) is depth
    filled = without_pinholes(np.where(lost, np.float32(np.nan), depth))
    assert np.isnan(filled[110:190, 310:390]).all()
    assert np.isfinite(filled).mean() > 0.9


def test_a_word_of_the_users_own_file_works_from_the_command_line_function(tmp_path):
    """A thing that the package was never told is found by its description."""
    file = tmp_path / "mine.yaml"
    file.write_text("things:\n  brick: {shape: {length: [0.1, 0.14], height: [0.05, 0.07]}, colours: {blue: 1.0}}\n")
    rgb, depth = plain_table(blocks=BLOCKS)
    scene = detect_in_image(RgbdFrame(rgb, depth, CAMERA, POSE), "brick", str(file))
    assert scene.detections[0].label == "brick"
    assert np.hypot(*(scene.detections[0].geometry.centroid[:2] - (0.65, -0.2))) < 0.02
    with pytest.raises(ValueError, match="cannot read"):
        detect_in_image(RgbdFrame(rgb, depth, CAMERA, POSE), "brick", str(tmp_path / "none.yaml"))
