# SPDX-License-Identifier: Apache-2.0
"""Scenes, hands and commands made from numbers, for the tests of this package."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from uncom_common.camera import PinholeCamera
from uncom_common.primitive import Primitive
from uncom_common.transforms import apply, invert
from uncom_language.types import Act, Command, Reference, Relation, Span
from uncom_perception.types import (
    Box,
    Detection,
    Geometry,
    Hand,
    HandsFrame,
    MetricRay,
    PointingRay,
    Scene,
    TableSurface,
)
from uncom_reasoner.detector_phrases import CONTAINER, OBJECTS, phrases_for
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.types import Evidence, View

TABLE_Z = 0.72
CAMERA = PinholeCamera(640, 480, 522.0, 522.0, 319.5, 239.5)
CONTAINERS = ("bowl", "plate", "pan", "mug", "cup")
SIZES = {
    "lemon": (0.07, 0.05, 0.05),
    "banana": (0.19, 0.04, 0.04),
    "apple": (0.07, 0.07, 0.07),
    "bowl": (0.16, 0.16, 0.07),
    "plate": (0.22, 0.22, 0.02),
    "mug": (0.08, 0.08, 0.09),
    "box": (0.10, 0.08, 0.12),
    "bottle": (0.06, 0.06, 0.2),
}


def camera_pose() -> np.ndarray:
    """transform_camera_to_base of a camera 1.42 m above the floor that looks down at the table."""
    forward = np.array([0.66, 0.0, TABLE_Z]) - np.array([0.2, 0.0, 1.42])
    forward /= np.linalg.norm(forward)
    right = np.array([0.0, -1.0, 0.0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    matrix[:3, 3] = [0.2, 0.0, 1.42]
    return matrix


POSE = camera_pose()
VIEW = View(CAMERA, POSE)


@dataclass(frozen=True)
class Thing:
    """A box or disc on the table."""

    id: str
    kind: str
    x: float
    y: float
    yaw: float = 0.0
    colour: str = ""


def pixels(points: np.ndarray) -> np.ndarray:
    return CAMERA.project(apply(invert(POSE), points))


def detection(thing: Thing, rng: np.random.Generator) -> Detection:
    size = np.array(SIZES[thing.kind])
    local = rng.uniform(-0.5, 0.5, (500, 3)) * size
    if thing.kind in CONTAINERS:
        r = np.linalg.norm(local[:, :2], axis=1)
        local = local[r <= size[0] / 2.0]
    pose = np.eye(4)
    c, s = np.cos(thing.yaw), np.sin(thing.yaw)
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[:3, 3] = [thing.x, thing.y, TABLE_Z + size[2] / 2.0]
    cloud = apply(pose, local)
    uv = pixels(cloud)
    mask = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
    low, high = uv.min(axis=0), uv.max(axis=0)
    inside = np.clip(np.round(uv).astype(int), 0, [CAMERA.width - 1, CAMERA.height - 1])
    mask[inside[:, 1], inside[:, 0]] = True
    geometry = Geometry(cloud.mean(axis=0), pose, size, cloud.astype(np.float32))
    return Detection(thing.id, thing.kind, 0.9, Box(*map(float, (*low, *high))), mask, geometry)


def fits(phrase: str, thing: Thing) -> float:
    words = phrase.split()
    if phrase == OBJECTS or words[-1] == "object":
        match = 1.0
    elif phrase in ("red", "green", "blue", "yellow"):
        match = 1.0 if thing.colour == phrase else 0.01
    elif phrase == CONTAINER:
        match = 1.0 if thing.kind in CONTAINERS else 0.02
    elif words[-1] == "fruit":
        match = 1.0 if thing.kind in ("lemon", "banana", "apple") else 0.02
    elif words[-1] in ("tomato", "pear"):  # like nothing here
        match = 1e-5
    else:
        match = 1.0 if words[-1] == thing.kind else 0.0005
    for colour in words[:-1]:
        match *= 1.0 if colour == thing.colour else 0.02
    return match


def table(corners: np.ndarray | None = None) -> TableSurface:
    xy = np.array([[0.45, -0.5], [0.95, -0.5], [0.95, 0.5], [0.45, 0.5]]) if corners is None else corners
    polygon = np.column_stack([xy, np.full(len(xy), TABLE_Z)])
    return TableSurface(polygon, np.array([0.0, 0.0, 1.0]), pixels(polygon))


def scene(things: list[Thing], phrases: tuple[str, ...], seed: int = 0, **kwargs) -> Scene:
    rng = np.random.default_rng(seed)
    # As the detector answers: shares of soft memberships, and none of them with the probability that none fits.
    fit = 0.95 * np.array([[fits(p, t) for p in phrases] for t in things]).reshape(len(things), len(phrases))
    none = np.prod(1.0 - fit, axis=0)
    shares = fit / np.maximum(fit.sum(axis=0), 1e-9) * (1.0 - none)
    found = tuple(
        replace(detection(t, rng), phrase_scores=tuple(float(v) for v in shares[i])) for i, t in enumerate(things)
    )
    values = {"table": table(), **kwargs}
    return Scene(1.0, "base_footprint", found, values["table"], tuple(float(v) for v in none), "made")


def pointing(
    at: tuple[float, float, float],
    tip: tuple[float, float, float],
    times: np.ndarray,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    metric: bool = True,
) -> list[HandsFrame]:
    """A hand whose index finger (8 cm) points from `tip` at a point in the base frame, seen at several times."""
    rng = rng or np.random.default_rng(0)
    frames = []
    for stamp in times:
        end = np.array(tip)
        direction = np.array(at) - end + rng.normal(0.0, noise, 3) * np.linalg.norm(np.array(at) - end)
        direction /= np.linalg.norm(direction)
        base = end - 0.08 * direction
        in_camera = apply(invert(POSE), np.stack([base, end]))
        px = CAMERA.project(in_camera)
        d = px[1] - px[0]
        space = MetricRay(in_camera[0], in_camera[1], (in_camera[1] - in_camera[0]) / 0.08) if metric else None
        ray = PointingRay(tuple(px[0]), tuple(px[1]), tuple(d / np.linalg.norm(d)), 0.08, space)
        hand = Hand("right", 0.95, np.zeros((21, 3)), ray, 0.8)
        frames.append(HandsFrame(float(stamp), "camera", 640, 480, (hand,), 0))
    return frames


def reference(text: str, start: float, end: float, **kwargs) -> Reference:
    words = text.split()
    values = {"head": words[-1], "modifiers": tuple(words[:-1]), "concrete": True, **kwargs}
    return Reference(text=text, span=Span(start, end), **values)


def command(obj: Reference | None, target: Reference | None = None, **kwargs) -> Command:
    values = {
        "action_text": "take",
        "primitive": Primitive.PUT_IN if target else Primitive.PICK,
        "relation": Relation.IN if target else Relation.NONE,
        "text": "",
        **kwargs,
    }
    return Command("u1", Act.COMMAND, object=obj, target=target, **values)


def evidence(cmd: Command, things: list[Thing], hands: list[HandsFrame] = (), view: View = VIEW, **kwargs) -> Evidence:
    phrases = phrases_for(cmd)
    rays = observe_rays(list(hands), lambda _: POSE)
    return Evidence(cmd, scene(things, phrases, **kwargs), phrases, view, rays)
