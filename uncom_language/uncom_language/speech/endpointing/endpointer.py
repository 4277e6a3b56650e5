# SPDX-License-Identifier: Apache-2.0
"""Cuts a stream of sound into utterances."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pocketsphinx import Vad
from uncom_common.exceptions import InvalidConfigError

from uncom_language.speech.audio.samples import SAMPLE_RATE, FloatArray, Int16Array, StreamResampler, as_float, to_int16

FRAME_S = 0.03
_FRAME = round(FRAME_S * SAMPLE_RATE)


@dataclass(frozen=True, slots=True)
class Segment:
    """Sound of one utterance: mono 16 kHz int16, with pre-roll; start and end [s] on the stream's clock."""

    samples: Int16Array
    start_s: float

    @property
    def end_s(self) -> float:
        """Time just after the last sample."""
        return self.start_s + self.samples.size / SAMPLE_RATE


@dataclass(frozen=True, slots=True)
class Opened:
    """An utterance began; the sound since its pre-roll."""

    samples: Int16Array
    start_s: float


@dataclass(frozen=True, slots=True)
class Heard:
    """The next frame of the open utterance."""

    samples: Int16Array


@dataclass(frozen=True, slots=True)
class Ended:
    """The utterance is over; None if it did not stand out of the background."""

    segment: Segment | None


Event = Opened | Heard | Ended


@dataclass(frozen=True, slots=True)
class EndpointerConfig:
    """When an utterance begins and ends; all times in seconds."""

    pre_roll_s: float = 0.3  # kept before the first voiced frame
    hang_over_s: float = 0.8  # silence that ends an utterance
    min_voiced_s: float = 0.15  # voiced time within onset_window_s that begins one
    onset_window_s: float = 0.3
    max_length_s: float = 20.0  # longer ones are cut
    noise_window_s: float = 4.0  # over which the level of the background is taken
    margin_db: float = 7.0  # above the background
    floor_db: float = -58.0  # quieter frames [dB of full scale] never count
    vad_mode: int = 1  # 0 takes most for speech, 3 least

    def __post_init__(self) -> None:
        """Reject values that make no sense together."""
        if not 0.0 <= self.pre_roll_s <= 2.0:
            raise InvalidConfigError("pre_roll_s", self.pre_roll_s, "must be 0 to 2 s")
        if not 0.1 <= self.hang_over_s <= 3.0:
            raise InvalidConfigError("hang_over_s", self.hang_over_s, "must be 0.1 to 3 s")
        if not FRAME_S <= self.min_voiced_s <= self.onset_window_s:
            raise InvalidConfigError("min_voiced_s", self.min_voiced_s, "must be a frame to onset_window_s")
        if self.max_length_s < 2.0:
            raise InvalidConfigError("max_length_s", self.max_length_s, "must be at least 2 s")
        if self.vad_mode not in (0, 1, 2, 3):
            raise InvalidConfigError("vad_mode", self.vad_mode, "must be 0, 1, 2 or 3")


class UtteranceStream:
    """Takes chunks of any size, rate and channel count and returns utterances as they end.

    A frame is voiced if the voice detector says so and it is louder than the background by a margin. What is kept is
    bounded by max_length_s + pre_roll_s. The result depends on the samples alone, not on how they were cut.
    """

    def __init__(self, config: EndpointerConfig | None = None, sample_rate: int = SAMPLE_RATE) -> None:
        """Begin in silence."""
        self.config = config or EndpointerConfig()
        self._resampler = StreamResampler(sample_rate)
        self._vad = Vad(mode=self.config.vad_mode, sample_rate=SAMPLE_RATE, frame_length=FRAME_S)
        self._origin_s: float | None = None  # time of the first sample ever fed
        self._fed_in = 0  # samples fed since, at the input rate
        self._reset()

    def _reset(self) -> None:
        config = self.config
        self._rest: FloatArray = np.zeros(0, np.float32)
        self._position = 0  # samples cut into frames since the origin
        # A stream may begin in the middle of a word: the background is taken for quiet until half a second is known.
        quiet = [config.floor_db - config.margin_db] * 2
        history = max(1, round((config.pre_roll_s + config.onset_window_s) / FRAME_S))
        self._history: deque[Int16Array] = deque(maxlen=history)
        self._voiced: deque[bool] = deque(maxlen=max(1, round(config.onset_window_s / FRAME_S)))
        self._levels: deque[float] = deque(quiet, maxlen=max(1, round(config.noise_window_s / FRAME_S)))
        self._frames: list[Int16Array] = []
        self._start = 0
        self._silent = 0

    @property
    def in_speech(self) -> bool:
        """Whether an utterance is open."""
        return bool(self._frames)

    @property
    def silent_s(self) -> float:
        """How long nothing was said within the open utterance."""
        return self._silent * FRAME_S

    @property
    def now_s(self) -> float:
        """Time up to which all sound was examined."""
        return self._time(self._position)

    def _time(self, sample: int) -> float:
        return (self._origin_s or 0.0) + sample / SAMPLE_RATE

    def feed(self, samples: npt.NDArray[np.generic], stamp_s: float) -> list[Segment]:
        """Add samples, (N,) or (N, channels), whose first one was heard at `stamp_s`; return utterances that ended.

        A gap or a jump of the stamps of more than 0.2 s ends the open utterance.

        Raises:
            SoundFormatError: neither int16 nor floating point samples.
        """
        ended = [event.segment for event in self.events(samples, stamp_s) if isinstance(event, Ended)]
        return [segment for segment in ended if segment is not None]

    def events(self, samples: npt.NDArray[np.generic], stamp_s: float) -> Iterator[Event]:
        """Add samples as `feed` does; yield what happens frame by frame. Between events, `cut` may end the utterance.

        Raises:
            SoundFormatError: neither int16 nor floating point samples.
        """
        mono = as_float(samples)
        rate = self._resampler.sample_rate
        if self._origin_s is None:
            self._origin_s = stamp_s
        expected = self._origin_s + self._fed_in / rate
        if abs(stamp_s - expected) > 0.2:
            if self._frames:
                yield self.cut()
            self._resampler = StreamResampler(rate)
            self._reset()
            self._origin_s, self._fed_in = stamp_s, 0
        elif abs(stamp_s - expected) > 0.02:  # the sender's clock runs a little differently
            self._origin_s += stamp_s - expected
        self._fed_in += mono.size
        self._rest = np.concatenate([self._rest, self._resampler.feed(mono)])
        while self._rest.size >= _FRAME:
            frame, self._rest = to_int16(self._rest[:_FRAME]), self._rest[_FRAME:]
            yield from self._frame(frame)

    def flush(self) -> list[Segment]:
        """End the open utterance, if there is one (end of a file, a gap in the stream)."""
        segment = self.cut().segment if self._frames else None
        return [segment] if segment is not None else []

    def _frame(self, frame: Int16Array) -> Iterator[Event]:
        voiced = self._is_voiced(frame)
        self._history.append(frame)
        self._voiced.append(voiced)
        self._position += frame.size
        if not self._frames:
            if sum(self._voiced) * FRAME_S >= self.config.min_voiced_s:
                self._open()
                yield Opened(np.concatenate(self._frames), self._time(self._start))
            return
        self._frames.append(frame)
        self._silent = 0 if voiced else self._silent + 1
        yield Heard(frame)
        if not self._frames:  # cut by who got the frame
            return
        long = len(self._frames) * FRAME_S >= self.config.max_length_s
        if long or self._silent * FRAME_S >= self.config.hang_over_s:
            yield self.cut()

    def _open(self) -> None:
        """Begin an utterance, pre-roll before the first voiced frame of the onset window."""
        recent = list(self._voiced)
        since_first = len(recent) - recent.index(True)
        kept = min(len(self._history), since_first + round(self.config.pre_roll_s / FRAME_S))
        self._frames = list(self._history)[-kept:]
        self._start = self._position - kept * _FRAME
        self._silent = 0

    def cut(self) -> Ended:
        """End the open utterance; it counts if it stands out of the background as known by now."""
        segment = Segment(np.concatenate(self._frames), self._time(self._start))
        threshold = self._background() + self.config.margin_db
        standing_out = sum(_level_db(frame) > threshold for frame in self._frames)
        self._frames = []
        self._silent = 0
        self._voiced.clear()
        self._history.clear()
        return Ended(segment if standing_out * FRAME_S >= self.config.min_voiced_s else None)

    def _background(self) -> float:
        """Return the level [dB] of the quietest tenth of the last seconds: the background even during speech."""
        levels = np.fromiter(self._levels, float)
        return float(np.partition(levels, len(levels) // 10)[len(levels) // 10])

    def _is_voiced(self, frame: Int16Array) -> bool:
        level = _level_db(frame)
        self._levels.append(level)
        loud = level > max(self.config.floor_db, self._background() + self.config.margin_db)
        return loud and bool(self._vad.is_speech(frame.tobytes()))


def _level_db(frame: Int16Array) -> float:
    """Return the level of a frame [dB of full scale]."""
    return float(10.0 * np.log10(np.mean(np.square(frame.astype(np.float32) / 32768.0)) + 1e-12))
