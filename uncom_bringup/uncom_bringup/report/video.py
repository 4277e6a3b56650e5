# SPDX-License-Identifier: Apache-2.0
"""The video of a run: what a bystander and the robot's camera saw, side by side, with what was heard and understood."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import av
import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from uncom_bringup.bags.image_codec import Rgb, decode_colour
from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import Frame, RunRecord
from uncom_bringup.replay.playback_clock import prefetch
from uncom_bringup.report import progress
from uncom_bringup.report.options import VIDEO

_PRESET = "veryfast"
_TEXT_COLOUR, _LABEL_COLOUR, _BACKGROUND = (245, 245, 245), (160, 170, 180), (24, 28, 34)
_CAPTION_ROWS = (run_record.TRANSCRIPT, run_record.COMMAND, run_record.EXECUTION)
_LABELS = {run_record.TRANSCRIPT: "heard", run_record.COMMAND: "understood", run_record.EXECUTION: "robot"}


@dataclass(frozen=True, slots=True)
class Caption:
    """A line of text from a moment on [s, ROS clock], in its row."""

    start_s: float
    row: int
    text: str


def captions(record: RunRecord) -> list[Caption]:
    """Return what the captions say, in order of time."""
    found = []
    for event in record.events:
        text = progress.line(event)
        if text is None:
            continue
        head, tail = text[: progress.HEAD_WIDTH].strip(), text[progress.HEAD_WIDTH :].strip()
        if event.kind == run_record.GROUNDED:
            if event.data["status"] != run_record.STATUS_GROUNDED:
                found.append(Caption(event.clock_s, _CAPTION_ROWS.index(run_record.EXECUTION), tail))
        elif event.kind in _CAPTION_ROWS:
            words = f"{head}: {tail}" if event.kind == run_record.EXECUTION and tail else (tail or head)
            found.append(Caption(event.clock_s, _CAPTION_ROWS.index(event.kind), words))
    return found


def write_video(path: Path, record: RunRecord, begin_s: float, end_s: float) -> bool:
    """Write an H.264 video of the time from begin_s to end_s [ROS clock]; False if there are no pictures of it.

    It runs at the pace of the ROS clock, however fast the simulation went.
    """
    shown = [frames for frames in (record.overview, record.camera) if frames]
    if not shown or end_s <= begin_s:
        return False
    width, height = VIDEO.width_px * len(shown), VIDEO.height_px + VIDEO.captions_px
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream(
            "libx264", rate=VIDEO.rate_hz, options={"preset": _PRESET, "crf": str(VIDEO.rate_factor)}
        )
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.thread_count = 1
        # One core puts the pictures together while the other one encodes.
        pictures = prefetch(_pictures(record, shown, begin_s, end_s), most=8)
        for number, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, VIDEO.rate_hz)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return True


def _pictures(record: RunRecord, shown: Sequence[Sequence[Frame]], begin_s: float, end_s: float) -> Iterator[Rgb]:
    texts = captions(record)
    cursors = [_Cursor(frames) for frames in shown]
    count = max(1, round((end_s - begin_s) * VIDEO.rate_hz))
    for number in range(count):
        now_s = begin_s + number / VIDEO.rate_hz
        views = [cursor.at(now_s) for cursor in cursors]
        rows = [""] * len(_CAPTION_ROWS)
        for caption in texts:
            if caption.start_s <= now_s:
                rows[caption.row] = caption.text
        yield np.vstack(
            [np.hstack(views), _draw_captions(VIDEO.width_px * len(shown), tuple(rows), round(now_s - begin_s, 1))]
        )


class _Cursor:
    """Walks along frames; decodes each at most once."""

    def __init__(self, frames: Sequence[Frame]) -> None:
        self._frames = sorted(frames, key=lambda frame: frame.stamp_s)
        self._index = -1
        self._picture: Rgb = np.zeros((VIDEO.height_px, VIDEO.width_px, 3), np.uint8)

    def at(self, now_s: float) -> Rgb:
        """Return the newest picture that is not from after now_s (the first one before that)."""
        index = self._index
        while index + 1 < len(self._frames) and (self._frames[index + 1].stamp_s <= now_s or index < 0):
            index += 1
        if index != self._index:
            self._index = index
            self._picture = _fitted(decode_colour(self._frames[index].jpeg))
        return self._picture


def _fitted(picture: Rgb) -> Rgb:
    """Scale a picture into its place, with bars where its shape differs."""
    height, width = picture.shape[:2]
    scale = min(VIDEO.width_px / width, VIDEO.height_px / height)
    size = (round(width * scale), round(height * scale))
    small = picture if size == (width, height) else cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    canvas = np.full((VIDEO.height_px, VIDEO.width_px, 3), _BACKGROUND, np.uint8)
    top, left = (VIDEO.height_px - size[1]) // 2, (VIDEO.width_px - size[0]) // 2
    canvas[top : top + size[1], left : left + size[0]] = small
    return canvas


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Take the font that matplotlib carries, without importing matplotlib."""
    spec = importlib.util.find_spec("matplotlib")
    for folder in spec.submodule_search_locations or () if spec is not None else ():
        path = Path(folder) / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
        if path.exists():
            return ImageFont.truetype(str(path), size)
    return ImageFont.load_default(size)


@lru_cache(maxsize=8)
def _draw_captions(width: int, rows: tuple[str, ...], seconds: float) -> npt.NDArray[np.uint8]:
    image = Image.new("RGB", (width, VIDEO.captions_px), _BACKGROUND)
    draw = ImageDraw.Draw(image)
    for row, text in enumerate(rows):
        top = 8 + row * 27
        draw.text((VIDEO.margin_px, top + 3), _LABELS[_CAPTION_ROWS[row]], fill=_LABEL_COLOUR, font=_font(13))
        draw.text((VIDEO.margin_px + 92, top), _shortened(draw, text, width - 200), fill=_TEXT_COLOUR, font=_font(17))
    draw.text((width - VIDEO.margin_px, 11), f"{seconds:.1f} s", fill=_LABEL_COLOUR, font=_font(13), anchor="ra")
    return np.asarray(image, np.uint8)


def _shortened(draw: ImageDraw.ImageDraw, text: str, width: int) -> str:
    if draw.textlength(text, font=_font(17)) <= width:
        return text
    while text and draw.textlength(text + "…", font=_font(17)) > width:
        text = text[:-1]
    return text + "…"
