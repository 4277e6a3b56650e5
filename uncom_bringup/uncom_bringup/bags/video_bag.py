# SPDX-License-Identifier: Apache-2.0
"""A plain video as a bag: its sound, its pictures, and a guess at its camera.

Without depth and transforms everything is judged in the image plane. Written by the message definitions alone, without
ROS, so that a video can be turned into a bag anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import VideoReformatter
from rosbags.convert.converter import default_message

from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.bags.image_codec import encode_jpeg
from uncom_bringup.bags.message_types import register
from uncom_bringup.bags.options import VIDEO_BAG, VideoBagOptions
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.graph import topics
from uncom_bringup.graph.topics import Topic

SAMPLE_RATE = 16000
_FRAME = "camera"
_COMPRESSED = "sensor_msgs/msg/CompressedImage"


@dataclass(frozen=True, slots=True)
class _Entry:
    """One message of the bag, serialised."""

    time_s: float
    topic: Topic
    data: bytes


def write_video_bag(video: Path, bag: Path, options: VideoBagOptions = VIDEO_BAG) -> Path:
    """Write the sound and the pictures of a video file into a bag (.mcap).

    Raises:
        BadInputError: it is no video, or it has no sound or no pictures.
    """
    sound = _sound(video)
    entries = [*_sound_entries(sound, options), *_picture_entries(video, options)]
    if not any(entry.topic is topics.RGB for entry in entries):
        raise BadInputError(f"{video} has no pictures that can be decoded")
    with BagWriter(bag, force=True) as writer:
        for topic in (topics.AUDIO_INFO, topics.AUDIO, topics.RGB, topics.RGB_INFO):
            writer.add_topic(
                topic.stored_name, _COMPRESSED if topic is topics.RGB else topic.type_name, latched=topic.latched
            )
        for entry in sorted(entries, key=lambda entry: entry.time_s):
            writer.write(entry.topic.stored_name, round(1e9 * entry.time_s), entry.data)
    return bag


def _open(video: Path, kind: str) -> Any:
    try:
        container = av.open(str(video))
    except (av.FFmpegError, OSError) as error:
        raise BadInputError(f"{video} is not a video that can be read ({type(error).__name__})") from error
    if not getattr(container.streams, kind):
        container.close()
        raise BadInputError(f"{video} has no {'sound' if kind == 'audio' else 'pictures'}")
    return container


def _start_s(container: Any) -> float:
    """Return when the file begins on its own clock [s]: sound and pictures need not begin together."""
    return float(container.start_time or 0) / float(av.time_base)


def _sound(video: Path) -> tuple[float, npt.NDArray[np.int16]]:
    """Return when the sound begins [s] and its samples (N,), mono."""
    resampler = av.AudioResampler(format="s16", layout="mono", rate=SAMPLE_RATE)
    chunks: list[npt.NDArray[np.int16]] = []
    begin_s: float | None = None
    with _open(video, "audio") as container:
        try:
            for frame in container.decode(audio=0):
                if begin_s is None:
                    begin_s = float(frame.time or 0.0) - _start_s(container)
                chunks += [np.asarray(part.to_ndarray(), np.int16).reshape(-1) for part in resampler.resample(frame)]
            chunks += [np.asarray(part.to_ndarray(), np.int16).reshape(-1) for part in resampler.resample(None)]
        except av.FFmpegError as error:
            if not chunks:
                raise BadInputError(f"the sound of {video} cannot be decoded") from error
    if begin_s is None or not chunks:
        raise BadInputError(f"{video} has no sound")
    return begin_s, np.concatenate(chunks).astype(np.int16)


def _sound_entries(sound: tuple[float, npt.NDArray[np.int16]], options: VideoBagOptions) -> Iterator[_Entry]:
    begin_s, samples = sound
    info = _message(
        topics.AUDIO_INFO,
        {"channels": 1, "sample_rate": SAMPLE_RATE, "sample_format": "S16LE", "coding_format": "wave"},
    )
    yield _Entry(options.start_s, topics.AUDIO_INFO, info)
    step = round(options.chunk_s * SAMPLE_RATE)
    for first in range(0, len(samples), step):
        chunk = samples[first : first + step]
        stamp_s = options.start_s + begin_s + first / SAMPLE_RATE
        fields = {"header": {"stamp": stamp_s}, "audio": {"data": np.frombuffer(chunk.tobytes(), np.uint8)}}
        yield _Entry(stamp_s + len(chunk) / SAMPLE_RATE, topics.AUDIO, _message(topics.AUDIO, fields))


def _picture_entries(video: Path, options: VideoBagOptions) -> Iterator[_Entry]:
    """Yield the pictures, at most max_picture_hz of them a second; a file that is cut off ends early."""
    reformatter = VideoReformatter()
    with _open(video, "video") as container:
        next_s = -math.inf
        try:
            for frame in container.decode(video=0):
                time_s = float(frame.time or 0.0) - _start_s(container)
                if time_s < next_s - 1e-6:
                    continue
                next_s = time_s + 1.0 / options.max_picture_hz
                scale = min(1.0, options.max_side_px / max(frame.width, frame.height))
                size = (2 * round(frame.width * scale / 2), 2 * round(frame.height * scale / 2))
                rgb = np.asarray(reformatter.reformat(frame, size[0], size[1], "rgb24").to_ndarray(), np.uint8)
                yield from _picture(
                    options.start_s + time_s, _turned(rgb, int(getattr(frame, "rotation", 0) or 0)), options
                )
        except av.FFmpegError:
            return


def _turned(rgb: npt.NDArray[np.uint8], degrees: int) -> npt.NDArray[np.uint8]:
    """Turn a picture as its file asks for: a telephone writes it as its chip lies."""
    return np.ascontiguousarray(np.rot90(rgb, round(degrees / 90) % 4))


def _picture(stamp_s: float, rgb: npt.NDArray[np.uint8], options: VideoBagOptions) -> Iterator[_Entry]:
    height, width = rgb.shape[:2]
    header = {"stamp": stamp_s, "frame_id": _FRAME}
    focal = 0.5 * max(width, height) / math.tan(math.radians(0.5 * options.view_angle_deg))
    k = np.array([focal, 0, 0.5 * width, 0, focal, 0.5 * height, 0, 0, 1])
    info = {
        "header": header,
        "width": width,
        "height": height,
        "distortion_model": "plumb_bob",
        "d": np.zeros(5),
        "k": k,
        "r": np.eye(3).reshape(-1),
        "p": np.array([focal, 0, 0.5 * width, 0, 0, focal, 0.5 * height, 0, 0, 0, 1, 0]),
    }
    yield _Entry(stamp_s, topics.RGB_INFO, _message(topics.RGB_INFO, info))
    data = np.frombuffer(encode_jpeg(rgb, options.jpeg_quality), np.uint8)
    fields = {"header": header, "format": "rgb8; jpeg compressed bgr8", "data": data}
    yield _Entry(stamp_s, topics.RGB, _message(topics.RGB, fields, _COMPRESSED))


def _message(topic: Topic, fields: Mapping[str, Any], type_name: str | None = None) -> bytes:
    """Serialise a message from plain values; what is not named has its default, a stamp is in seconds."""
    name = type_name or topic.type_name
    store = register(name)
    message = default_message(store, name)
    _fill(message, fields)
    return bytes(store.serialize_cdr(message, name))


def _fill(message: Any, fields: Mapping[str, Any]) -> None:
    for name, value in fields.items():
        if name == "stamp":
            whole = math.floor(value)
            _fill(message.stamp, {"sec": whole, "nanosec": min(999_999_999, round(1e9 * (value - whole)))})
        elif isinstance(value, Mapping):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
