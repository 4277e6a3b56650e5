# SPDX-License-Identifier: Apache-2.0
"""Transcription of a stream of sound: endpointing and recognition run in a worker thread."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import monotonic

import numpy as np
import numpy.typing as npt
from uncom_common.exceptions import UncomError

from uncom_language.exceptions import LanguageError
from uncom_language.speech.audio.samples import FloatArray, StreamResampler, as_float
from uncom_language.speech.endpointing.endpointer import Endpointer, SpeechEnded, SpeechFrame, SpeechStarted
from uncom_language.speech.endpointing.options import EndpointerOptions
from uncom_language.speech.options import STREAMING, StreamingOptions
from uncom_language.speech.recognition.recognizer import Recognizer, UtteranceDecoder
from uncom_language.speech.recognition.timestamps import transcript_of_segment
from uncom_language.speech.speech_status import SpeechState, SpeechStatus
from uncom_language.types import Transcript

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class TranscriberOptions:
    """Settings of the transcriber.

    Attributes:
        endpointer: when utterances begin and end.
        session: beginning of the id of every utterance.
        backlog_s: sound [s] that may wait for the recogniser.
        end_of_turn_pause_s: pause [s] that ends an utterance, by its words so far; None: always hang_over_s of the
            endpointer.
        streaming: how the worker goes about it.
    """

    endpointer: EndpointerOptions
    session: str
    backlog_s: float = STREAMING.backlog_s
    end_of_turn_pause_s: Callable[[str], float] | None = None
    streaming: StreamingOptions = STREAMING


@dataclass(frozen=True, slots=True)
class _Chunk:
    samples: FloatArray
    rate: int
    stamp_s: float

    @property
    def length_s(self) -> float:
        return self.samples.size / self.rate


class StreamingTranscriber:
    """Feeds sound to endpointer and recogniser, and reports transcripts and status.

    Speech is decoded while it arrives. `feed` never waits for that: chunks queue up, and when more than backlog_s wait
    the oldest are dropped and counted as rejected, so memory stays bounded. Callbacks come from the worker.
    """

    def __init__(
        self,
        make_recognizer: Callable[[], Recognizer],
        on_transcript: Callable[[Transcript], None],
        on_status: Callable[[SpeechStatus], None],
        options: TranscriberOptions,
    ) -> None:
        """Prepare; `start` begins.

        Args:
            make_recognizer: loads the recogniser, in the worker.
            on_transcript: takes every transcript; called by the worker.
            on_status: takes every change of the status; called by the worker.
            options: settings.
        """
        self._make_recognizer = make_recognizer
        self._on_transcript = on_transcript
        self._on_status = on_status
        self._options = options
        self._queue: deque[_Chunk] = deque()
        self._queued_s = 0.0
        self._new_words: dict[str, str] = {}
        self._changed = threading.Condition()
        self._stopping = False
        self._endpointer: Endpointer | None = None
        self._rate = 0
        self._decoder: UtteranceDecoder | None = None
        self._start_s = 0.0
        self._pauses_s: dict[str, float] = {}
        self._utterances = 0
        self._rejected = 0
        self._last_rejection = ""
        self._reported: SpeechStatus | None = None
        self._thread = threading.Thread(target=self._run, name="recogniser", daemon=True)

    def start(self) -> None:
        """Start the worker, which loads the recogniser."""
        self._thread.start()

    def stop(self) -> None:
        """Let the worker end after what it is doing now."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(timeout=self._options.streaming.stop_timeout_s)

    def feed(self, samples: npt.NDArray[np.generic], sample_rate: int, stamp_s: float) -> None:
        """Take a chunk whose first sample was heard at `stamp_s` [s].

        Raises:
            SoundFormatError: samples or a rate that cannot be used.
        """
        StreamResampler.check_sample_rate(sample_rate)
        chunk = _Chunk(as_float(samples), sample_rate, stamp_s)
        with self._changed:
            self._queue.append(chunk)
            self._queued_s += chunk.length_s
            if self._queued_s > self._options.backlog_s:
                self._drop_oldest()
            self._changed.notify_all()

    def add_words(self, words: Mapping[str, str]) -> None:
        """Let the recogniser know further words, word to pronunciation (empty: by spelling), from the next pause on."""
        with self._changed:
            self._new_words.update(words)
            self._changed.notify_all()

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until all sound that was fed is examined; whether that came true."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._queue, timeout_s)

    @property
    def idle(self) -> bool:
        """Whether all sound that was fed is examined and all new words are known."""
        with self._changed:
            return not self._queue and not self._can_add_words()

    def _drop_oldest(self) -> None:
        _LOG.warning("the recogniser is too slow: sound was dropped")
        while self._queued_s > self._options.backlog_s and len(self._queue) > 1:
            self._queued_s -= self._queue.popleft().length_s
        self._rejected += 1
        self._last_rejection = "the recogniser was too slow"

    def _run(self) -> None:
        try:
            recognizer = self._make_recognizer()
        except UncomError:
            _LOG.exception("the recogniser could not be loaded; nothing will be heard")
            return
        _LOG.info("listening with %s", recognizer.backend)
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._queue or self._can_add_words())
                if self._stopping:
                    return
                words = dict(self._new_words) if self._can_add_words() else {}
                chunk = self._queue[0] if self._queue else None
            if words:
                self._add_words(recognizer, words)
            if chunk is not None:
                self._process(recognizer, chunk)
                with self._changed:  # only now: whoever waits until all is examined may go on
                    if self._queue and self._queue[0] is chunk:
                        self._queue.popleft()
                        self._queued_s -= chunk.length_s
                    self._changed.notify_all()

    def _can_add_words(self) -> bool:
        """Whether there are new words and no utterance is being decoded."""
        return bool(self._new_words) and self._decoder is None

    def _add_words(self, recognizer: Recognizer, words: Mapping[str, str]) -> None:
        with self._changed:
            for word in words:
                self._new_words.pop(word, None)
        try:
            added = recognizer.add_words(words)
        except LanguageError as error:
            _LOG.warning("%s", error)
            added = recognizer.add_words(dict.fromkeys(words, ""))
        if added:
            _LOG.info("new words: %s", ", ".join(added))

    def _process(self, recognizer: Recognizer, chunk: _Chunk) -> None:
        if self._endpointer is None or chunk.rate != self._rate:
            if self._endpointer is not None and self._endpointer.in_speech:
                self._finish_utterance(recognizer, self._endpointer.end_utterance())
            self._endpointer = Endpointer(self._options.endpointer, chunk.rate)
            self._rate = chunk.rate
        for event in self._endpointer.events(chunk.samples, chunk.stamp_s):
            if isinstance(event, SpeechStarted):
                self._decoder, self._start_s = recognizer.start_utterance(), event.start_s
                self._pauses_s.clear()
                self._decoder.feed(event.samples)
            elif isinstance(event, SpeechFrame) and self._decoder is not None:
                self._decoder.feed(event.samples)
                if self._is_end_of_turn(self._endpointer.silent_s, self._decoder):
                    self._finish_utterance(recognizer, self._endpointer.end_utterance())
            elif isinstance(event, SpeechEnded):
                self._finish_utterance(recognizer, event)
        self._report_status()

    def _is_end_of_turn(self, silent_s: float, decoder: UtteranceDecoder) -> bool:
        """Whether a pause is long enough for the words so far."""
        end_of_turn_pause_s = self._options.end_of_turn_pause_s
        if end_of_turn_pause_s is None or silent_s < self._options.streaming.min_pause_s:
            return False
        words = decoder.partial_text()
        if words not in self._pauses_s:
            self._pauses_s[words] = end_of_turn_pause_s(words)
        return silent_s >= self._pauses_s[words]

    def _finish_utterance(self, recognizer: Recognizer, ended: SpeechEnded) -> None:
        """Take what was heard, and report it unless it did not stand out of the background."""
        decoder, self._decoder = self._decoder, None
        if decoder is None:
            return
        self._report_status(SpeechState.RECOGNISING)
        started = monotonic()
        try:
            recognition = decoder.finish()
        except (LanguageError, RuntimeError) as error:
            _LOG.warning("recognition failed: %s", error)
            self._reject(f"recognition failed: {error}")
            return
        if ended.segment is None:
            return
        if not recognition.words:
            self._reject(recognition.reason)
            return
        self._utterances += 1
        name = f"{self._options.session}-{self._utterances}"
        self._on_transcript(transcript_of_segment(recognition, self._start_s, name, recognizer, monotonic() - started))

    def _reject(self, reason: str) -> None:
        with self._changed:
            self._rejected += 1
            self._last_rejection = reason

    def _report_status(self, state: SpeechState | None = None) -> None:
        """Report the status if it changed, and every second of sound."""
        endpointer = self._endpointer
        if endpointer is None:
            return
        if state is None:
            state = SpeechState.SPEECH if endpointer.in_speech else SpeechState.IDLE
        until = endpointer.now_s if state is SpeechState.IDLE else self._start_s
        status = SpeechStatus(until, state, self._rejected, self._last_rejection)
        last = self._reported
        same = last is not None and (last.state, last.rejected) == (status.state, status.rejected)
        if (
            same
            and last is not None
            and abs(status.examined_until_s - last.examined_until_s) < self._options.streaming.status_period_s
        ):
            return
        self._reported = status
        self._on_status(status)
