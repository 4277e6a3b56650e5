# SPDX-License-Identifier: Apache-2.0
"""Clutter as real depth cameras see it: printed boxes, stacks, smeared edges, necks between things by chance."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, camera_pose, overlap, plain_table
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.objects.segments.patch_merging import borders, evidence, merged
from uncom_perception.objects.segments.surface_patches import find_patches
from uncom_perception.objects.table.depth_cleaning import without_flying
from uncom_perception.rgbd_frame import RgbdFrame


@pytest.fixture(scope="module")
def detector():
    return TabletopDetector()


def noisy(depth, seed, noise_m):
    """Give noise that neighbouring pixels share and that grows with the square of distance, and whole millimetres."""
    grain = cv2.GaussianBlur(np.random.default_rng(seed).normal(0.0, 1.0, depth.shape), (0, 0), 2.0) * 7.0
    return np.round(depth + grain * noise_m * depth**2, 3).astype(np.float32)


def smeared(depth, width):
    """Draw every step in depth out over a width of pixels, as matching windows of stereo cameras do."""
    step = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3))) > 0.02
    near = cv2.dilate(step.astype(np.uint8), np.ones((width, width))) > 0
    return np.where(near, cv2.blur(depth, (width, width)), depth).astype(np.float32)


def printed(rgb, colour, seed):
    """Paint what has a colour with large patches of other colours, as packages are."""
    rng = np.random.default_rng(seed)
    where = np.all(rgb == colour, axis=2)
    tiles = rng.integers(20, 235, (24, 32, 3)).astype(np.uint8)
    paint = cv2.resize(tiles, rgb.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    result = rgb.copy()
    result[where] = paint[where]
    return result, where


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("noise_m", [0.001, 0.003])
def test_a_printed_box_is_one_thing_whatever_is_printed_on_it(detector, seed, noise_m):
    """Patches of colour on a noisy front are no things."""
    rgb, depth = plain_table(blocks=[(0.65, 0.05, 0.08, 0.19, 0.24, (9, 8, 7))], noise_m=0.0)
    rgb, truth = printed(rgb, (9, 8, 7), seed)
    scene = detector.detect(RgbdFrame(rgb, noisy(depth, seed, noise_m), CAMERA, POSE), [])
    assert len(scene.detections) == 1
    assert overlap(scene.detections[0].mask, truth) > 0.85


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise_m", [0.0007, 0.002])
def test_a_box_on_a_box_before_a_box_are_three(detector, seed, noise_m):
    """Things that stand on and before one another are told apart although they are printed."""
    colours = [(9, 8, 7), (7, 9, 8), (8, 7, 9)]
    blocks = [
        (0.68, 0.0, 0.22, 0.26, 0.07, colours[0]),
        (0.70, 0.02, 0.08, 0.1, 0.19, colours[1]),
        (0.52, 0.0, 0.07, 0.14, 0.11, colours[2]),
    ]
    rgb, depth = plain_table(blocks=blocks, noise_m=0.0)
    truths = []
    for i, colour in enumerate(colours):
        rgb, truth = printed(rgb, colour, 10 * seed + i)
        truths.append(truth)
    scene = detector.detect(RgbdFrame(rgb, noisy(depth, seed, noise_m), CAMERA, POSE), [])
    assert len(scene.detections) == 3
    for truth in truths:
        assert max(overlap(d.mask, truth) for d in scene.detections) > 0.6


@pytest.mark.parametrize("gap", [0.0, 0.05, 0.15])
@pytest.mark.parametrize("pitch", [0.95, 0.6])
def test_a_wall_behind_the_table_is_no_thing_nor_part_of_one(detector, gap, pitch):
    """A block of its colour before it is found whole."""
    pose = camera_pose(pitch)
    wall = (1.0 + gap, 0.0, 0.1, 3.0, 1.5, (200, 200, 195))
    blocks = [wall, (0.9, 0.2, 0.08, 0.08, 0.2, (190, 190, 190)), (0.88, -0.2, 0.1, 0.1, 0.25, (30, 60, 200))]
    rgb, depth = plain_table(blocks=blocks, pose=pose, noise_m=0.002, seed=9100)
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, pose), [])
    assert len(scene.detections) == 2
    for *_, colour in blocks[1:]:
        assert max(overlap(d.mask, np.all(rgb == colour, axis=2)) for d in scene.detections) > 0.85


def test_a_row_of_boxes_along_the_edge_stays(detector):
    """It is as long as a wall, but low, or has table behind it."""
    for x, height in ((0.9, 0.1), (0.75, 0.2)):
        rgb, depth = plain_table(blocks=[(x, 0.0, 0.08, 0.8, height, (200, 30, 30))], noise_m=0.002, seed=9101)
        assert len(detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE), []).detections) == 1


@pytest.mark.parametrize("width", [5, 9])
def test_smeared_edges_make_no_thing_much_longer(detector, width):
    """What hangs in the air behind a thing is not measured with it."""
    sides = (0.07, 0.07, 0.12)
    rgb, depth = plain_table(blocks=[(0.62, 0.1, *sides, (200, 30, 30))], noise_m=0.0005)
    scene = detector.detect(RgbdFrame(rgb, smeared(depth, width), CAMERA, POSE), [])
    size = max((d.geometry.size for d in scene.detections), key=lambda s: float(s[2]))
    assert float(size[0]) < sides[0] + 0.035
    assert float(size[2]) == pytest.approx(sides[2], abs=0.02)


def test_only_pixels_that_hang_between_two_surfaces_are_dropped():
    """A ramp along the line of sight goes; a sharp edge, a slanting surface and a lone step stay."""
    row = np.concatenate([np.full(20, 0.8), np.linspace(0.8, 1.0, 7)[1:-1], np.full(20, 1.0), np.full(20, 0.7)])
    kept = np.isfinite(without_flying(np.tile(row, (8, 1)).astype(np.float32), 525.0))
    assert not kept[:, 20:25].any()
    assert kept[:, :19].all()
    assert kept[:, 27:].all()
    slant = np.tile(np.linspace(0.7, 1.3, 200), (8, 1)).astype(np.float32)
    assert np.isfinite(without_flying(slant, 525.0)).all()


@pytest.mark.parametrize(("neck", "groups"), [(3, 2), (40, 1)])
def test_a_narrow_neck_does_not_join_large_things_of_other_colours(neck, groups):
    """Two level squares in one plane are one thing if they meet along a side, two if a few pixels join them."""
    own = np.zeros((60, 121), bool)
    own[:, :58] = own[:, 63:] = True
    own[30 - neck // 2 : 31 + neck // 2, 58:63] = True
    v, u = np.mgrid[0:60, 0:121]
    points = np.stack([u * 0.003, v * 0.003, np.full(own.shape, 0.1)], axis=-1).astype(np.float32)
    normals = np.zeros_like(points)
    normals[..., 2] = 1.0
    lab = np.where((u < 60)[..., None], np.float32([50, 50, 30]), np.float32([50, -30, 40])).astype(np.float32)
    patches = find_patches(points, normals, lab, own.astype(np.int32), 0.003)
    a, b, length = borders(patches.index, np.ones((60, 120), bool), np.ones((59, 121), bool))
    group = merged(patches, a, b, length, *evidence(patches, a, b))
    assert len(np.unique(group[1:])) == groups


def test_without_depth_uneven_light_and_the_tables_edge_make_no_things(detector):
    """Lamp light that fades and changes colour over the table is no thing; a block is."""
    rgb, _ = plain_table(blocks=[(0.65, 0.1, 0.08, 0.08, 0.1, (200, 30, 30))])
    truth = np.all(rgb == (200, 30, 30), axis=2)
    ramp = np.linspace(0.6, 1.25, rgb.shape[1])[:, None] * np.array([1.0, 1.0, 0.9])
    lit = np.clip(rgb * ramp[None], 0, 255).astype(np.uint8)
    scene = detector.detect(RgbdFrame(lit), ["objects"])
    assert len(scene.detections) == 1
    assert overlap(scene.detections[0].mask, truth) > 0.8
    assert "without depth" in scene.backend
