# SPDX-License-Identifier: Apache-2.0
"""A video becomes a bag: its sound and pictures, each at its time."""

from __future__ import annotations

from fractions import Fraction

import av
import numpy as np
import pytest
from uncom_bringup.bags import image_codec
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.bags.options import VIDEO_BAG
from uncom_bringup.bags.video_bag import write_video_bag
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.graph import topics

FPS, SECONDS, RATE, BEEP_S = 30, 2, 48000, 1.2


def write_video(path, sound=True, pictures=True, size=(320, 240)):
    """Grey pictures that get lighter; silence with a tone from BEEP_S on."""
    with av.open(str(path), "w") as container:
        film = container.add_stream("libx264", rate=FPS) if pictures else None
        track = container.add_stream("aac", rate=RATE, layout="stereo") if sound else None
        if film is not None:
            film.width, film.height, film.pix_fmt = *size, "yuv420p"
            for number in range(FPS * SECONDS):
                grey = np.full((size[1], size[0], 3), 40 + 3 * number, np.uint8)
                frame = av.VideoFrame.from_ndarray(grey, format="rgb24")
                frame.pts, frame.time_base = number, Fraction(1, FPS)
                container.mux(film.encode(frame))
            container.mux(film.encode(None))
        if track is not None:
            time_s = np.arange(RATE * SECONDS) / RATE
            tone = np.where(time_s >= BEEP_S, 8000 * np.sin(2 * np.pi * 440 * time_s), 0.0).astype(np.int16)
            for first in range(0, len(tone), 1024):
                part = np.repeat(tone[first : first + 1024], 2)[None]
                frame = av.AudioFrame.from_ndarray(part, format="s16", layout="stereo")
                frame.sample_rate, frame.pts, frame.time_base = RATE, first, Fraction(1, RATE)
                container.mux(track.encode(frame))
            container.mux(track.encode(None))
    return path


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mkv"])
def test_sound_and_pictures_keep_their_times(tmp_path, name):
    write_video_bag(write_video(tmp_path / name), tmp_path / "clip.mcap")
    with BagReader(tmp_path / "clip.mcap") as bag:
        found = {topic.name: [] for topic in bag.topics}
        for message in bag.messages():
            found[message.topic.name].append(bag.deserialise(message))
    assert found[topics.AUDIO_INFO.name][0].sample_rate == 16000
    samples = np.concatenate([np.frombuffer(m.audio.data.tobytes(), np.int16) for m in found[topics.AUDIO.name]])
    heard_s = stamp(found[topics.AUDIO.name][0]) + np.argmax(np.abs(samples) > 2000) / 16000
    assert heard_s == pytest.approx(VIDEO_BAG.start_s + BEEP_S, abs=0.05)
    pictures = found[topics.RGB.stored_name]
    assert len(pictures) == pytest.approx(10 * SECONDS, abs=1)
    for picture in pictures:
        grey = image_codec.decode_colour(picture.data.tobytes()).mean()
        assert grey == pytest.approx(40 + 3 * FPS * (stamp(picture) - VIDEO_BAG.start_s), abs=6)
    info = found[topics.RGB_INFO.name][0]
    assert (info.width, info.height) == (320, 240)
    assert info.k[0] > 0.5 * info.width


def test_large_pictures_are_scaled_down(tmp_path):
    write_video_bag(write_video(tmp_path / "large.mp4", size=(1920, 1080)), tmp_path / "large.mcap")
    with BagReader(tmp_path / "large.mcap") as bag:
        infos = [bag.deserialise(message) for message in bag.messages([topics.RGB_INFO.name])]
    assert (infos[0].width, infos[0].height) == (960, 540)


def test_what_lacks_sound_or_pictures_is_told_so(tmp_path):
    mute = write_video(tmp_path / "mute.mp4", sound=False)
    blind = write_video(tmp_path / "blind.mp4", pictures=False)
    text = tmp_path / "text.mp4"
    text.write_text("no video")
    for path, word in ((mute, "no sound"), (blind, "no pictures"), (text, "not a video")):
        with pytest.raises(BadInputError, match=word):
            write_video_bag(path, tmp_path / "x.mcap")
    assert not (tmp_path / "x.mcap").exists()
