# SPDX-License-Identifier: Apache-2.0
"""A take as a bag: the very bytes of its images, its sound in the chunks of the robot's driver, its transforms."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage
from tf2_msgs.msg import TFMessage
from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.graph import topics
from uncom_bringup.graph.topics import Form, Topic
from uncom_bringup.monitor.conversions import COMPRESSED_FORMATS
from uncom_common.conversions import camera_to_msg, header_to_msg, stamped_transform_to_msg

from uncom_sim.bench_understanding.takes.recording import StoredFrame, TakeRecording
from uncom_sim.driver.options import AUDIO
from uncom_sim.driver.ros.conversions import audio_info_to_msg, audio_to_msg


def write_bag(take: TakeRecording, path: Path, *, force: bool = False) -> Path:
    """Write a take as a bag (.mcap) that `uncom understand` and `uncom replay` take.

    Raises:
        OutputExistsError: something is there already and `force` is not given.
    """
    with BagWriter(path, force=force) as bag:
        for topic in (
            topics.AUDIO_INFO,
            topics.TF_STATIC,
            topics.AUDIO,
            topics.TF,
            topics.RGB,
            topics.RGB_INFO,
            topics.DEPTH,
            topics.DEPTH_INFO,
        ):
            stored = topic.type_name if topic.form is Form.PLAIN else "sensor_msgs/msg/CompressedImage"
            bag.add_topic(topic.stored_name, stored, topic.latched)
        for time_s, topic, msg in sorted(_messages(take), key=lambda entry: entry[0]):
            bag.write(topic.stored_name, round(time_s * 1e9), serialize_message(msg))
    return path


def _messages(take: TakeRecording) -> Iterator[tuple[float, Topic, Any]]:
    """Yield times [s], topics and messages; a chunk of sound comes when it has been heard."""
    start = take.sound_start_s
    fixed = [stamped_transform_to_msg(transform) for transform, static in take.transforms if static]
    yield start, topics.AUDIO_INFO, audio_info_to_msg()
    yield start, topics.TF_STATIC, TFMessage(transforms=fixed)
    step = round(AUDIO.chunk_s * take.sample_rate)
    for first in range(0, len(take.samples), step):
        chunk = take.samples[first : first + step]
        stamp = start + first / take.sample_rate
        yield stamp + len(chunk) / take.sample_rate, topics.AUDIO, audio_to_msg(chunk, stamp)
    moving = [transform for transform, static in take.transforms if not static]
    for frame in take.stored:
        now = [stamped_transform_to_msg(t) for t in moving if t.stamp_s == frame.stamp_s]
        yield frame.stamp_s, topics.TF, TFMessage(transforms=now)
        yield from _pictures(take, frame)


def _pictures(take: TakeRecording, frame: StoredFrame) -> Iterator[tuple[float, Topic, Any]]:
    header = header_to_msg(frame.stamp_s, take.camera_frame)
    info = camera_to_msg(take.camera, header)
    for topic, data in ((topics.RGB, frame.jpeg), (topics.DEPTH, frame.depth_png)):
        image = CompressedImage(header=header, format=COMPRESSED_FORMATS[topic.form], data=data)
        yield frame.stamp_s, topic, image
    yield frame.stamp_s, topics.RGB_INFO, info
    yield frame.stamp_s, topics.DEPTH_INFO, info
