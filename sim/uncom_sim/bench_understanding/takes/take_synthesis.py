# SPDX-License-Identifier: Apache-2.0
"""Synthesis of a take: the simulated person speaks and points, the robot's camera and microphone record."""

from __future__ import annotations

import functools
import hashlib
from importlib import resources
from pathlib import Path

import numpy as np
from uncom_bringup.bags import image_codec
from uncom_bringup.bags import options as image_options
from uncom_bringup.bags.image_codec import encode_depth, encode_jpeg

from uncom_sim.bench_understanding.takes.options import FILMING, FilmingOptions
from uncom_sim.bench_understanding.takes.recording import Link, StoredFrame, TakeRecording, TruePointing, Truth
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.camera.noise import CameraNoise
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.person.behaviour import PersonBehaviour
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.types import SpokenWord
from uncom_sim.world.simulator import Simulator
from uncom_sim.world.simulator_types import Frames, SimulatorOptions

# Whose change makes other takes of the same plan.
_SOURCES = (
    "types.py",
    "person",
    "objects",
    "camera",
    "robot",
    "world",
    "bench_understanding/takes/options.py",
    "bench_understanding/takes/take_synthesis.py",
    "bench_understanding/takes/recording.py",
)


@functools.cache
def generator_version() -> str:
    """Return a digest of all that draws and speaks: takes made by other sources are others."""
    root = Path(str(resources.files("uncom_sim")))
    digest = hashlib.sha256()
    for module in (image_codec, image_options):
        digest.update(Path(str(module.__file__)).read_bytes())
    for name in _SOURCES:
        path = root / name
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def make_take(plan: TakePlan, *, filming_options: FilmingOptions = FILMING) -> TakeRecording:
    """Film one take; the same plan gives the same bytes.

    Raises:
        SimError: the scene cannot be built.
    """
    conditions = plan.conditions
    options = SimulatorOptions(noise=CameraNoise().scaled(conditions.camera_noise), light=conditions.light)
    simulator = Simulator(plan.scene, plan.world_seed, options)
    try:
        person = simulator.world.person
        stored = tuple(
            _frame(
                simulator,
                person,
                number / filming_options.rate_hz,
                conditions.exposure_s,
                filming_options=filming_options,
            )
            for number in range(_count(person, filming_options=filming_options))
        )
        links = (*_links(simulator.moving_frames(), static=False), *_links(simulator.fixed_frames(), static=True))
        return TakeRecording(
            samples=person.samples,
            sound_start_s=filming_options.start_s,
            camera=HEAD_CAMERA,
            camera_frame=CAMERA_FRAME,
            links=links,
            stored=stored,
            truth=Truth(
                tuple(
                    SpokenWord(w.text, filming_options.start_s + w.start_s, filming_options.start_s + w.end_s)
                    for w in person.words
                ),
                tuple(
                    TruePointing(
                        p.role, _three(p.place), filming_options.start_s + p.start_s, filming_options.start_s + p.end_s
                    )
                    for p in person.pointing
                ),
                simulator.object_states(),
                str(person.attributes.side or ""),
            ),
        )
    finally:
        simulator.close()


def _count(person: PersonBehaviour, *, filming_options: FilmingOptions = FILMING) -> int:
    """Return how many images matter: all up to a while after the last word."""
    last = person.words[-1].end_s + filming_options.after_words_s if person.words else person.duration_s
    return int(np.floor(min(last, person.duration_s) * filming_options.rate_hz)) + 1


def _frame(
    simulator: Simulator,
    person: PersonBehaviour,
    time_s: float,
    exposure_s: float,
    *,
    filming_options: FilmingOptions = FILMING,
) -> StoredFrame:
    rgb, depth = simulator.film(
        time_s, exposure_s, moments_of(person, time_s, exposure_s, filming_options=filming_options)
    )
    return StoredFrame(filming_options.start_s + time_s, encode_jpeg(rgb), encode_depth(depth))


def moments_of(
    person: PersonBehaviour, time_s: float, exposure_s: float, *, filming_options: FilmingOptions = FILMING
) -> int:
    """Return how many moments of the exposure have to be drawn for a smooth blur: an odd number, 1 for none."""
    ends = [person.hand_at(time_s + share * exposure_s) for share in (-0.5, 0.5)]
    if ends[0] is None or ends[1] is None:
        return 1
    joints = person.hand.joints
    moved = [joints @ pose[:3, :3].T + pose[:3, 3] for pose in ends if pose is not None]
    pixels = float(np.linalg.norm(moved[1] - moved[0], axis=1).max()) * HEAD_CAMERA.fx / 0.8
    if pixels < filming_options.blur_px:
        return 1
    return 3 if pixels < filming_options.fast_px else 5


def _links(frames: Frames, *, static: bool) -> tuple[Link, ...]:
    rows = zip(frames.parents, frames.children, frames.places.tolist(), frames.quaternions.tolist(), strict=True)
    return tuple(Link(parent, child, tuple(place), tuple(turn), static) for parent, child, place, turn in rows)


def _three(place: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in place)
    return x, y, z
