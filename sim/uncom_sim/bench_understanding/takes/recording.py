# SPDX-License-Identifier: Apache-2.0
"""One take as made: what the robot's senses gave, and beside it the truth that only the scorer reads."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from uncom_bringup.bags.image_codec import decode_colour, decode_depth
from uncom_bringup.chain.recording import CameraFrame
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import StampedTransform, matrix_from_pose
from uncom_perception.objects.scene_detector import OutsidePoses

from uncom_sim.exceptions import SimError
from uncom_sim.types import SAMPLE_RATE_HZ, ObjectState, SpokenWord

DEPTH_ENCODING = "32FC1"  # what image_codec.encode_depth writes
_META, _SOUND = "take.json", "sound.npy"


@dataclass(frozen=True, slots=True)
class StoredFrame:
    """One image as it is stored: stamp [s], JPEG colours, 16-bit PNG depth (see uncom_bringup.bags.image_codec)."""

    stamp_s: float
    jpeg: bytes
    depth_png: bytes


@dataclass(frozen=True, slots=True)
class Link:
    """Pose of a child frame in its parent: place [m] and quaternion (x y z w); static ones never move."""

    parent: str
    child: str
    place: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    static: bool


@dataclass(frozen=True, slots=True)
class TruePointing:
    """Where the person pointed for a role: place (3,) [m] and when [s, stamps]."""

    role: str
    place: tuple[float, float, float]
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Truth:
    """What only the scorer knows; times are stamps [s]."""

    words: tuple[SpokenWord, ...]
    pointing: tuple[TruePointing, ...]
    states: tuple[ObjectState, ...]
    side: str


@dataclass(frozen=True)
class TakeRecording:
    """The senses of one take (a uncom_bringup.chain.chain.Recording) with its truth."""

    samples: npt.NDArray[np.int16]
    sound_start_s: float
    camera: PinholeCamera
    camera_frame: str
    links: tuple[Link, ...]
    stored: tuple[StoredFrame, ...]
    truth: Truth
    sample_rate: int = SAMPLE_RATE_HZ
    object_poses: tuple[OutsidePoses, ...] = ()

    @property
    def transforms(self) -> Sequence[tuple[StampedTransform, bool]]:
        """All transforms with whether they are static; those of joints that could move come with every image."""
        stamps = [frame.stamp_s for frame in self.stored]
        found: list[tuple[StampedTransform, bool]] = []
        for link in self.links:
            matrix = matrix_from_pose(link.place, link.quaternion)
            times = [0.0] if link.static else stamps
            found += [(StampedTransform(t, link.parent, link.child, matrix), link.static) for t in times]
        return found

    @cached_property
    def _decoded(self) -> tuple[CameraFrame, ...]:
        return tuple(
            CameraFrame(f.stamp_s, decode_colour(f.jpeg), decode_depth(f.depth_png, DEPTH_ENCODING))
            for f in self.stored
        )

    def frames(self) -> Iterator[CameraFrame]:
        """Yield the images in order of time."""
        yield from self._decoded


def save_take(path: Path, take: TakeRecording, plan: dict[str, Any]) -> None:
    """Write a take as one file; it is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    truth = take.truth
    meta = {
        "plan": plan,
        "sound_start_s": take.sound_start_s,
        "camera": asdict(take.camera),
        "camera_frame": take.camera_frame,
        "links": [asdict(link) for link in take.links],
        "stamps": [frame.stamp_s for frame in take.stored],
        "truth": {
            "words": [asdict(word) for word in truth.words],
            "pointing": [asdict(one) for one in truth.pointing],
            "states": [_state_to_dict(state) for state in truth.states],
            "side": truth.side,
        },
    }
    partial = path.with_suffix(f".{os.getpid()}.partial")
    sound = io.BytesIO()
    np.save(sound, take.samples)
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_STORED) as file:
        file.writestr(_META, json.dumps(meta))
        file.writestr(_SOUND, sound.getvalue(), zipfile.ZIP_DEFLATED)
        for number, frame in enumerate(take.stored):
            file.writestr(f"frames/{number:03d}.jpg", frame.jpeg)
            file.writestr(f"frames/{number:03d}.depth", frame.depth_png)
    partial.replace(path)


def load_take(path: Path) -> TakeRecording:
    """Read a take.

    Raises:
        SimError: it is not there, or damaged.
    """
    try:
        with zipfile.ZipFile(path) as file:
            meta = json.loads(file.read(_META))
            samples = np.load(io.BytesIO(file.read(_SOUND)))
            stored = tuple(
                StoredFrame(stamp, file.read(f"frames/{i:03d}.jpg"), file.read(f"frames/{i:03d}.depth"))
                for i, stamp in enumerate(meta["stamps"])
            )
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise SimError(f"the take {path} cannot be read ({error}); remove it to have it made again") from error
    truth = meta["truth"]
    return TakeRecording(
        samples=samples,
        sound_start_s=meta["sound_start_s"],
        camera=PinholeCamera(**meta["camera"]),
        camera_frame=meta["camera_frame"],
        links=tuple(
            Link(one["parent"], one["child"], tuple(one["place"]), tuple(one["quaternion"]), one["static"])
            for one in meta["links"]
        ),
        stored=stored,
        truth=Truth(
            words=tuple(SpokenWord(**word) for word in truth["words"]),
            pointing=tuple(
                TruePointing(one["role"], tuple(one["place"]), one["start_s"], one["end_s"])
                for one in truth["pointing"]
            ),
            states=tuple(_state_from_dict(one) for one in truth["states"]),
            side=truth["side"],
        ),
    )


def _state_to_dict(state: ObjectState) -> dict[str, Any]:
    return {
        "id": state.id,
        "kind": state.kind,
        "colour": state.colour,
        "pose": np.asarray(state.pose).tolist(),
        "size": np.asarray(state.size).tolist(),
    }


def _state_from_dict(data: dict[str, Any]) -> ObjectState:
    return ObjectState(data["id"], data["kind"], data["colour"], np.array(data["pose"]), np.array(data["size"]))
