# SPDX-License-Identifier: Apache-2.0
"""A human hand and forearm as one smooth skin over a skeleton, pointing with the index finger.

Hand frame of a right hand: origin in the wrist, x towards the fingers, y to the thumb's side, z out of the back of the
hand. A left hand is its mirror image in y. Joints are numbered as hand trackers do: 0 wrist, 1-4 thumb, 5-8 index,
9-12 middle, 13-16 ring, 17-20 little finger, base to tip.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
import trimesh
from skimage.measure import marching_cubes

from uncom_sim.objects.model import Part, Tile, flat_tile, ramp_tile
from uncom_sim.objects.palette import Rgb, mixed
from uncom_sim.objects.shapes import tube
from uncom_sim.person.options import HAND_MODEL, HandModelOptions

FloatArray = npt.NDArray[np.float64]


class HandLandmark(IntEnum):
    """Joints of a hand as hand trackers number them (MediaPipe)."""

    WRIST = 0
    THUMB_CMC = 1
    THUMB_MCP = 2
    THUMB_IP = 3
    THUMB_TIP = 4
    INDEX_BASE = 5
    INDEX_PIP = 6
    INDEX_DIP = 7
    INDEX_TIP = 8
    MIDDLE_BASE = 9
    MIDDLE_PIP = 10
    MIDDLE_DIP = 11
    MIDDLE_TIP = 12
    RING_BASE = 13
    RING_PIP = 14
    RING_DIP = 15
    RING_TIP = 16
    LITTLE_BASE = 17
    LITTLE_PIP = 18
    LITTLE_DIP = 19
    LITTLE_TIP = 20


@dataclass(frozen=True, slots=True)
class Finger:
    """One finger of an adult hand of 19 cm as it is held while the index finger points.

    base_m (3,) is in the hand frame; bones_m are the lengths of its three bones, radii_m the radii at its four joints,
    bends_deg how far each joint bends, spread_deg how far the finger is spread to the thumb's side.
    """

    base_m: tuple[float, float, float]
    bones_m: tuple[float, float, float]
    radii_m: tuple[float, float, float, float]
    bends_deg: tuple[float, float, float]
    spread_deg: float


@dataclass(frozen=True, slots=True)
class SkinTone:
    """The colour of a tone of skin from 0 (light) to 1 (dark)."""

    tone: float
    colour: Rgb


_INDEX = Finger((0.093, 0.026, 0.001), (0.046, 0.027, 0.021), (0.0105, 0.0092, 0.0080, 0.0066), (3.0, 6.0, 3.0), 3.0)
_MIDDLE = Finger(
    (0.096, 0.003, 0.003), (0.050, 0.031, 0.022), (0.0108, 0.0095, 0.0083, 0.0070), (72.0, 95.0, 55.0), 1.0
)
_RING = Finger(
    (0.089, -0.019, 0.001), (0.046, 0.029, 0.022), (0.0102, 0.0090, 0.0079, 0.0066), (78.0, 96.0, 55.0), -2.0
)
_LITTLE = Finger(
    (0.079, -0.037, -0.004), (0.036, 0.021, 0.019), (0.0092, 0.0080, 0.0070, 0.0058), (76.0, 92.0, 50.0), -5.0
)
FINGERS = (_INDEX, _MIDDLE, _RING, _LITTLE)
_SKIN_TONES = (
    SkinTone(0.0, (0.91, 0.74, 0.64)),
    SkinTone(0.3, (0.87, 0.68, 0.57)),
    SkinTone(0.6, (0.72, 0.52, 0.40)),
    SkinTone(1.0, (0.47, 0.32, 0.24)),
)


@dataclass(frozen=True, slots=True)
class Hand:
    """A "left" or "right" hand to be shown: joints (21, 3) in the hand frame [m] and its painted surfaces."""

    handedness: str
    joints: FloatArray
    parts: tuple[Part, ...]

    @property
    def pointing_axis(self) -> FloatArray:
        """Unit direction (3,) from the base to the tip of the index finger."""
        axis = self.joints[HandLandmark.INDEX_TIP] - self.joints[HandLandmark.INDEX_BASE]
        return np.asarray(axis / np.linalg.norm(axis))


def skin_colour(tone: float) -> Rgb:
    """Return the colour of a skin tone from 0 (light) to 1 (dark)."""
    tones = [skin.tone for skin in _SKIN_TONES]
    r, g, b = (float(np.interp(tone, tones, [skin.colour[c] for skin in _SKIN_TONES])) for c in range(3))
    return (r, g, b)


def build_hand(
    handedness: str, size: float, tone: float, sleeve: Rgb, *, options: HandModelOptions = HAND_MODEL
) -> Hand:
    """Build a pointing hand with its forearm.

    Args:
        handedness: "left" or "right".
        size: scale; 1 is a hand of 19 cm.
        tone: skin from 0 (light) to 1 (dark).
        sleeve: colour of the sleeve.
        options: sizes of forearm, thumb and sleeve, and resolution of the skin.
    """
    joints, vertices, normals, faces, flush = _right_hand(options=options)
    mirror = np.array([1.0, -1.0 if handedness == "left" else 1.0, 1.0])
    turn = slice(None, None, -1) if handedness == "left" else slice(None)
    skin = Part(
        vertices * mirror * size,
        normals * mirror,
        np.column_stack([flush, np.full(len(flush), 0.5)]),
        faces[:, turn],
        _skin_tile(skin_colour(tone)),
    )
    return Hand(handedness, joints * mirror * size, (skin, _sleeve(sleeve, size, mirror, turn, options=options)))


def joints_of_right_hand(*, options: HandModelOptions = HAND_MODEL) -> FloatArray:
    """Return the joints (21, 3) of a pointing right hand [m]."""
    joints = [np.asarray(point) for point in options.thumb_joints_m]
    for finger in FINGERS:
        spread, bend = np.radians(finger.spread_deg), 0.0
        joints.append(np.asarray(finger.base_m))
        for length, angle in zip(finger.bones_m, np.radians(finger.bends_deg), strict=True):
            bend += angle
            along = np.array([np.cos(bend) * np.cos(spread), np.cos(bend) * np.sin(spread), -np.sin(bend)])
            joints.append(joints[-1] + length * along)
    return np.stack(joints)


@functools.cache
def _right_hand(
    *, options: HandModelOptions = HAND_MODEL
) -> tuple[FloatArray, FloatArray, FloatArray, npt.NDArray[np.int64], FloatArray]:
    """Joints, vertices, normals, faces of the skin, and how flushed it is at each vertex (0 to 1)."""
    joints = joints_of_right_hand(options=options)
    axes = (
        np.concatenate(
            [np.arange(-options.forearm_m - 0.04, -0.05, 0.020), np.arange(-0.05, 0.20, options.grid_step_m)]
        ),
        np.arange(-0.068, 0.068, options.grid_step_m),
        np.arange(-0.085, 0.042, options.grid_step_m),
    )
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = _skin_distance(grid.reshape(-1, 3), joints, options=options).reshape(grid.shape[:3])
    at, faces, _, _ = marching_cubes(distance, 0.0, gradient_direction="ascent")
    vertices = np.column_stack([np.interp(at[:, i], np.arange(len(axis)), axis) for i, axis in enumerate(axes)])
    normals = np.empty_like(vertices)
    for i in range(3):
        offset = np.zeros(3)
        offset[i] = 0.0008
        normals[:, i] = _skin_distance(vertices + offset, joints, options=options) - _skin_distance(
            vertices - offset, joints, options=options
        )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.volume < 0:
        faces = faces[:, ::-1]
    return joints, vertices, normals, np.asarray(faces, dtype=np.int64), _redness(vertices, normals, joints)


def _skin_distance(points: FloatArray, joints: FloatArray, *, options: HandModelOptions = HAND_MODEL) -> FloatArray:
    """Signed distance (N,) from points (N, 3) to the skin [m], softly blended where the parts of the hand meet."""
    fingers = []
    for k, finger in enumerate(FINGERS):
        chain = joints[5 + 4 * k : 9 + 4 * k]
        radii = finger.radii_m
        bones = [_capsule_distance(points, chain[i], chain[i + 1], radii[i], radii[i + 1]) for i in range(3)]
        fingers.append(_smooth_minimum(bones, 0.0015))
    thumb = [
        _capsule_distance(points, joints[i], joints[i + 1], options.thumb_radii_m[i], options.thumb_radii_m[i + 1])
        for i in range(1, 4)
    ]
    palm = [_capsule_distance(points, *bone) for bone in _palm_capsules(joints)]
    arm = _forearm_distance(points, options=options)
    return _smooth_minimum(
        [_smooth_minimum(palm, 0.005), _smooth_minimum(thumb, 0.002), *fingers, arm], options.blend_m
    )


def _palm_capsules(joints: FloatArray) -> list[tuple[FloatArray, FloatArray, float, float]]:
    wrist = {5: (0.008, 0.014, 0.0), 9: (0.006, 0.005, 0.002), 13: (0.006, -0.006, 0.001), 17: (0.008, -0.015, -0.003)}
    bones = [(np.asarray(at), joints[knuckle] - [0, 0, 0.002], 0.0165, 0.0118) for knuckle, at in wrist.items()]
    inside = np.array([0.0, 0.0, -0.010])
    bones += [(joints[a] + inside, joints[a + 4] + inside, 0.0105, 0.0105) for a in (5, 9, 13)]
    bones.append((np.array([0.012, 0.012, -0.008]), joints[2] * 0.9, 0.0170, 0.0150))
    bones.append((np.array([0.015, -0.016, -0.010]), np.array([0.060, -0.034, -0.012]), 0.0150, 0.0125))
    bones.append((joints[2] * 0.95, joints[5] * np.array([0.72, 0.9, 1]) - [0, 0, 0.006], 0.0120, 0.0110))
    return bones


def _forearm_distance(points: FloatArray, *, options: HandModelOptions = HAND_MODEL) -> FloatArray:
    """Distance to the forearm: flat at the wrist, round and thicker towards the elbow."""
    along = np.clip(-points[:, 0] / options.forearm_m, -0.03, 1.0)
    wide = np.interp(along, [-0.03, 0.0, 0.12, 0.5, 0.85, 1.0], [0.024, 0.0265, 0.0265, 0.036, 0.043, 0.043])
    high = np.interp(along, [-0.03, 0.0, 0.12, 0.5, 0.85, 1.0], [0.0175, 0.0185, 0.0195, 0.031, 0.040, 0.040])
    beyond = points[:, 0] + options.forearm_m * along
    flat = np.sqrt((points[:, 1] / wide) ** 2 + ((points[:, 2] + 0.002) / high) ** 2)
    return np.asarray(
        np.hypot(np.maximum(flat - 1.0, -1.0) * np.minimum(wide, high), 0.0) * np.sign(flat - 1.0) + np.abs(beyond)
    )


def _capsule_distance(points: FloatArray, a: FloatArray, b: FloatArray, radius_a: float, radius_b: float) -> FloatArray:
    axis = np.asarray(b) - np.asarray(a)
    share = np.clip((points - a) @ axis / max(float(axis @ axis), 1e-12), 0.0, 1.0)
    return np.asarray(
        np.linalg.norm(points - a - share[:, None] * axis, axis=1) - (radius_a + (radius_b - radius_a) * share)
    )


def _smooth_minimum(distances: list[FloatArray], width: float) -> FloatArray:
    stacked = np.stack(distances)
    nearest = stacked.min(axis=0)
    return np.asarray(nearest - width * np.log(np.exp(-(stacked - nearest) / width).sum(axis=0)))


def _redness(vertices: FloatArray, normals: FloatArray, joints: FloatArray) -> FloatArray:
    """How red the skin is: more over knuckles and tips, less in the palm; near 1 is a nail."""
    value = np.full(len(vertices), 0.35) - 0.12 * np.clip(-normals[:, 2], 0.0, 1.0)
    for i in (5, 9, 13, 17, 6, 10, 14, 18, 4, 8, 12, 16, 20):
        near = np.exp(-((np.linalg.norm(vertices - joints[i], axis=1) / 0.014) ** 2))
        value += 0.28 * near
    value = np.clip(value, 0.02, 0.85)
    facing, behind, ahead, radius = 0.72, -0.008, 0.005, 0.012  # of a nail: cosine, and lengths from the tip [m]
    tips = ((HandLandmark.INDEX_TIP, HandLandmark.INDEX_DIP), (HandLandmark.THUMB_TIP, HandLandmark.THUMB_IP))
    for tip, before in tips:
        along = joints[tip] - joints[before]
        along /= np.linalg.norm(along)
        local = vertices - joints[tip]
        out = normals @ (np.array([0.0, 0.0, 1.0]) if tip == HandLandmark.INDEX_TIP else np.array([0.3, 0.75, 0.6]))
        nail = (
            (out > facing)
            & (local @ along > behind)
            & (local @ along < ahead)
            & (np.linalg.norm(local, axis=1) < radius)
        )
        value[nail] = 0.97
    return value


def _skin_tile(colour: Rgb) -> Tile:
    pale, red = mixed(colour, (1.0, 0.86, 0.78), 0.25), mixed(colour, (0.70, 0.30, 0.25), 0.30)
    nail = mixed(colour, (0.97, 0.80, 0.76), 0.6)
    return ramp_tile([(0.0, pale), (0.35, colour), (0.88, red), (0.93, nail), (1.0, nail)])


def _sleeve(
    colour: Rgb, size: float, mirror: FloatArray, turn: slice, *, options: HandModelOptions = HAND_MODEL
) -> Part:
    x = np.array([-0.145, -0.150, -0.20, -0.28, -0.42, -options.sleeve_end_m])
    radii = np.array([0.041, 0.0445, 0.049, 0.053, 0.057, 0.064])
    mesh = tube(np.column_stack([x, np.zeros(6), np.full(6, -0.002)]), radii, segments=24)
    return Part(
        np.array(mesh.vertices) * mirror * size,
        np.array(mesh.vertex_normals) * mirror,
        np.full((len(mesh.vertices), 2), 0.5),
        np.array(mesh.faces)[:, turn],
        flat_tile(colour),
    )
