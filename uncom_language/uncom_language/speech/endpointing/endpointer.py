# SPDX-License-Identifier: Apache-2.0
"""Endpointing: where utterances begin and end in a stream of sound."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pocketsphinx import Vad

from uncom_language.speech.audio.samples import (
    INT16_SCALE,
    SAMPLE_RATE,
    FloatArray,
    Int16Array,
    StreamResampler,
    as_float,
    to_int16,
)
from uncom_language.speech.endpointing.options import ENDPOINTER, FRAME_S, EndpointerOptions

_FRAME_SAMPLES = round(FRAME_S * SAMPLE_RATE)


@dataclass(frozen=True, slots=True)
class SpeechSegment:
    """Sound of one utterance: mono 16 kHz int16, with pre-roll; start and end [s] on the stream's clock."""

    samples: Int16Array
    start_s: float

    @property
    def end_s(self) -> float:
        """Time just after the last sample."""
        return self.start_s + self.samples.size / SAMPLE_RATE


@dataclass(frozen=True, slots=True)
class SpeechStarted:
    """An utterance began; the sound since its pre-roll."""

    samples: Int16Array
    start_s: float


@dataclass(frozen=True, slots=True)
class SpeechFrame:
    """The next frame of the open utterance."""

    samples: Int16Array


@dataclass(frozen=True, slots=True)
class SpeechEnded:
    """The utterance is over; None if it did not stand out of the background."""

    segment: SpeechSegment | None


EndpointerEvent = SpeechStarted | SpeechFrame | SpeechEnded


class Endpointer:
    """Takes chunks of any size, rate and channel count and returns utterances as they end.

    A frame is voiced if the voice detector says so and it is louder than the background by a margin. What is kept is
    bounded by max_length_s + pre_roll_s. The result depends on the samples alone, not on the chunks.
    """

    def __init__(self, options: EndpointerOptions = ENDPOINTER, sample_rate: int = SAMPLE_RATE) -> None:
        """Begin in silence; `sample_rate` [Hz] is that of the sound to come."""
        self._options = options
        self._resampler = StreamResampler(sample_rate)
        self._vad = Vad(mode=self._options.vad_mode, sample_rate=SAMPLE_RATE, frame_length=FRAME_S)
        self._origin_s: float | None = None  # time of the first sample ever fed
        self._input_samples = 0  # samples fed since, at the input rate
        self._reset()

    def _reset(self) -> None:
        options = self._options
        self._remainder: FloatArray = np.zeros(0, np.float32)
        self._position_samples = 0  # samples cut into frames since the origin
        # A stream may begin in the middle of a word: the background is taken for quiet until half a second is known.
        quiet = [options.floor_db - options.margin_db] * 2
        history = max(1, round((options.pre_roll_s + options.onset_window_s) / FRAME_S))
        self._recent_frames: deque[Int16Array] = deque(maxlen=history)
        self._recent_voicing: deque[bool] = deque(maxlen=max(1, round(options.onset_window_s / FRAME_S)))
        self._recent_levels_db: deque[float] = deque(quiet, maxlen=max(1, round(options.noise_window_s / FRAME_S)))
        self._utterance_frames: list[Int16Array] = []
        self._start_sample = 0
        self._silent_frames = 0

    @property
    def in_speech(self) -> bool:
        """Whether an utterance is open."""
        return bool(self._utterance_frames)

    @property
    def silent_s(self) -> float:
        """How long nothing was said within the open utterance."""
        return self._silent_frames * FRAME_S

    @property
    def now_s(self) -> float:
        """Time up to which all sound was examined."""
        return self._time_of_sample(self._position_samples)

    def _time_of_sample(self, sample: int) -> float:
        return (self._origin_s or 0.0) + sample / SAMPLE_RATE

    def feed(self, samples: npt.NDArray[np.generic], stamp_s: float) -> list[SpeechSegment]:
        """Add samples, (N,) or (N, channels), whose first one was heard at `stamp_s`; return utterances that ended.

        A gap or a jump of the stamps of more than max_stamp_gap_s ends the open utterance.

        Raises:
            SoundFormatError: neither int16 nor floating point samples.
        """
        ended = [event.segment for event in self.events(samples, stamp_s) if isinstance(event, SpeechEnded)]
        return [segment for segment in ended if segment is not None]

    def events(self, samples: npt.NDArray[np.generic], stamp_s: float) -> Iterator[EndpointerEvent]:
        """Add samples as `feed` does; yield what happens frame by frame.

        Between events, `end_utterance` may end the utterance.

        Raises:
            SoundFormatError: neither int16 nor floating point samples.
        """
        mono = as_float(samples)
        rate = self._resampler.sample_rate
        if self._origin_s is None:
            self._origin_s = stamp_s
        expected = self._origin_s + self._input_samples / rate
        if abs(stamp_s - expected) > self._options.max_stamp_gap_s:
            if self._utterance_frames:
                yield self.end_utterance()
            self._resampler = StreamResampler(rate)
            self._reset()
            self._origin_s, self._input_samples = stamp_s, 0
        elif abs(stamp_s - expected) > self._options.max_clock_drift_s:  # the sender's clock runs a little differently
            self._origin_s += stamp_s - expected
        self._input_samples += mono.size
        self._remainder = np.concatenate([self._remainder, self._resampler.feed(mono)])
        while self._remainder.size >= _FRAME_SAMPLES:
            frame, self._remainder = to_int16(self._remainder[:_FRAME_SAMPLES]), self._remainder[_FRAME_SAMPLES:]
            yield from self._process_frame(frame)

    def flush(self) -> list[SpeechSegment]:
        """End the open utterance, if there is one (end of a file, a gap in the stream)."""
        segment = self.end_utterance().segment if self._utterance_frames else None
        return [segment] if segment is not None else []

    def _process_frame(self, frame: Int16Array) -> Iterator[EndpointerEvent]:
        voiced = self._is_voiced(frame)
        self._recent_frames.append(frame)
        self._recent_voicing.append(voiced)
        self._position_samples += frame.size
        if not self._utterance_frames:
            if sum(self._recent_voicing) * FRAME_S >= self._options.min_voiced_s:
                self._start_utterance()
                yield SpeechStarted(np.concatenate(self._utterance_frames), self._time_of_sample(self._start_sample))
            return
        self._utterance_frames.append(frame)
        self._silent_frames = 0 if voiced else self._silent_frames + 1
        yield SpeechFrame(frame)
        if not self._utterance_frames:  # ended by who got the frame
            return
        long = len(self._utterance_frames) * FRAME_S >= self._options.max_length_s
        if long or self._silent_frames * FRAME_S >= self._options.hang_over_s:
            yield self.end_utterance()

    def _start_utterance(self) -> None:
        """Begin an utterance, pre-roll before the first voiced frame of the onset window."""
        recent = list(self._recent_voicing)
        since_first = len(recent) - recent.index(True)
        kept = min(len(self._recent_frames), since_first + round(self._options.pre_roll_s / FRAME_S))
        self._utterance_frames = list(self._recent_frames)[-kept:]
        self._start_sample = self._position_samples - kept * _FRAME_SAMPLES
        self._silent_frames = 0

    def end_utterance(self) -> SpeechEnded:
        """End the open utterance; it counts if it stands out of the background as known by now."""
        segment = SpeechSegment(np.concatenate(self._utterance_frames), self._time_of_sample(self._start_sample))
        threshold = self._background_level_db() + self._options.margin_db
        loud_frames = sum(_level_db(frame) > threshold for frame in self._utterance_frames)
        self._utterance_frames = []
        self._silent_frames = 0
        self._recent_voicing.clear()
        self._recent_frames.clear()
        return SpeechEnded(segment if loud_frames * FRAME_S >= self._options.min_voiced_s else None)

    def _background_level_db(self) -> float:
        """Return the level [dB] of the quietest tenth of the last seconds: the background even during speech."""
        levels = np.fromiter(self._recent_levels_db, float)
        rank = len(levels) // self._options.noise_divisor
        return float(np.partition(levels, rank)[rank])

    def _is_voiced(self, frame: Int16Array) -> bool:
        level = _level_db(frame)
        self._recent_levels_db.append(level)
        loud = level > max(self._options.floor_db, self._background_level_db() + self._options.margin_db)
        return loud and bool(self._vad.is_speech(frame.tobytes()))


def _level_db(frame: Int16Array) -> float:
    """Return the level of a frame [dB of full scale]."""
    return float(10.0 * np.log10(np.mean(np.square(frame.astype(np.float32) / INT16_SCALE)) + 1e-12))
