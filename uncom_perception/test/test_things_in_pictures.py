# SPDX-License-Identifier: Apache-2.0
"""Without depth: what is no table is a thing, what is between the table's legs is none."""

import cv2
import numpy as np
import pytest
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.rgbd_frame import RgbdFrame

WOOD, WALL, FLOOR = (178, 134, 92), (120, 124, 130), (70, 66, 64)


def room(seed: int = 0) -> np.ndarray:
    """A table with two legs before a wall: far edge at row 110, front edge at row 380."""
    image = np.zeros((480, 640, 3), np.uint8)
    image[:] = WALL
    image[400:] = FLOOR
    cv2.fillPoly(image, [np.array([[60, 110], [580, 110], [635, 380], [5, 380]])], WOOD)
    for low in (20, 560):
        image[380:, low : low + 60] = tuple(int(0.9 * v) for v in WOOD)
    noise = np.random.default_rng(seed).normal(scale=3.0, size=image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def found(image: np.ndarray) -> list[np.ndarray]:
    """Return the masks of what is seen in a picture."""
    scene = TabletopDetector().detect(RgbdFrame(image), ["objects"])
    return [d.mask for d in scene.detections]


def overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    return float(np.count_nonzero(mask & truth) / np.count_nonzero(mask | truth))


def test_the_gap_between_the_legs_of_a_table_is_no_thing():
    image = room()
    cv2.circle(image, (300, 250), 40, (200, 30, 30), -1)
    masks = found(image)
    assert len(masks) == 1
    assert masks[0][250, 300]


@pytest.mark.parametrize(("top", "bottom", "at"), [(30, 180, 300), (300, 410, 380)])
def test_a_thing_that_hides_an_edge_of_the_table_is_seen_whole(top, bottom, at):
    image = room(1)
    truth = np.zeros(image.shape[:2], np.uint8)
    cv2.rectangle(truth, (at, top), (at + 70, bottom), 1, -1)
    image[truth > 0] = (40, 70, 180)
    masks = found(image)
    assert max((overlap(m, truth > 0) for m in masks), default=0.0) > 0.85


def test_print_on_a_thing_is_part_of_it():
    image = room(2)
    cv2.rectangle(image, (250, 180), (390, 330), (60, 60, 170), -1)
    cv2.rectangle(image, (285, 220), (355, 290), WOOD, 12)  # a frame of the table's colour
    masks = found(image)
    assert len(masks) == 1
    assert masks[0][182:329, 252:389].all()


@pytest.mark.parametrize("seed", range(4))
def test_touching_things_of_different_colours_are_two_and_a_striped_one_is_one(seed):
    rng = np.random.default_rng(seed)
    image = room(seed)
    u, v = rng.integers(180, 280), rng.integers(200, 260)
    cv2.circle(image, (u, v), 40, (190, 25, 25), -1)
    cv2.rectangle(image, (u + 35, v - 40), (u + 115, v + 45), (110, 40, 150), -1)
    cv2.rectangle(image, (470, 220), (540, 330), (30, 120, 50), -1)
    cv2.rectangle(image, (470, 260), (540, 280), (205, 205, 205), -1)
    masks = found(image)
    assert len(masks) == 3
    owners = [next(i for i, m in enumerate(masks) if m[y, x]) for x, y in ((u, v), (u + 80, v), (505, 240), (505, 270))]
    assert len(set(owners[:3])) == 3
    assert owners[2] == owners[3]
