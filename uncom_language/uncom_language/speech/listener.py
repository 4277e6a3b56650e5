# SPDX-License-Identifier: Apache-2.0
"""A stream of sound to transcripts: endpointer in the caller's thread, recogniser in a worker."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

import numpy as np
import numpy.typing as npt

from uncom_language.exceptions import LanguageError
from uncom_language.speech.audio import SAMPLE_RATE
from uncom_language.speech.recognizer import Recognizer
from uncom_language.speech.status import SpeechState, SpeechStatus
from uncom_language.speech.timeline import shifted_transcript
from uncom_language.speech.utterance_stream import EndpointerConfig, Segment, UtteranceStream
from uncom_language.types import Transcript

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ListenerOptions:
    """Settings of the listener."""

    endpointer: EndpointerConfig
    session: str  # beginning of every utterance's id
    queue_size: int = 8


class Listener:
    """Feeds sound to the endpointer and utterances to a recogniser, and reports transcripts and status.

    `feed` never waits for the recogniser. When more than queue_size utterances wait, the oldest is dropped and
    counted as rejected, so memory stays bounded. Callbacks come from the worker's or the feeding thread.
    """

    def __init__(
        self,
        make_recognizer: Callable[[], Recognizer],
        on_transcript: Callable[[Transcript], None],
        on_status: Callable[[SpeechStatus], None],
        options: ListenerOptions,
    ) -> None:
        """Keep the callbacks; `start` begins."""
        self._make_recognizer = make_recognizer
        self._on_transcript = on_transcript
        self._on_status = on_status
        self._options = options
        self._queue: queue.Queue[Segment | None] = queue.Queue(maxsize=options.queue_size)
        self._lock = threading.Lock()
        self._stream: UtteranceStream | None = None
        self._rate = 0
        self._waiting_since: list[float] = []  # starts [s] of utterances that are not yet recognised
        self._utterances = 0
        self._rejected = 0
        self._last_rejection = ""
        self._reported: SpeechStatus | None = None
        self._thread = threading.Thread(target=self._work, name="recogniser", daemon=True)
        self._stopping = threading.Event()

    def start(self) -> None:
        """Start the worker, which loads the recogniser."""
        self._thread.start()

    def stop(self) -> None:
        """Let the worker end after what it is recognising now."""
        self._stopping.set()
        try:
            self._queue.put_nowait(None)
        except queue.Full:
            self._drop_oldest()
            self._queue.put_nowait(None)
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)

    def feed(self, samples: npt.NDArray[np.generic], sample_rate: int, stamp_s: float) -> None:
        """Take a chunk whose first sample was heard at `stamp_s` [s].

        Raises:
            SoundFormatError: samples or a rate that cannot be used.
        """
        if self._stream is None or sample_rate != self._rate:
            if self._stream is not None:
                self._take(self._stream.flush())
            self._stream = UtteranceStream(self._options.endpointer, sample_rate)
            self._rate = sample_rate
        self._take(self._stream.feed(samples, stamp_s))
        self._report()

    def _take(self, segments: list[Segment]) -> None:
        for segment in segments:
            with self._lock:
                self._waiting_since.append(segment.start_s)
            try:
                self._queue.put_nowait(segment)
            except queue.Full:
                self._drop_oldest()
                self._queue.put_nowait(segment)

    def _drop_oldest(self) -> None:
        try:
            dropped = self._queue.get_nowait()
        except queue.Empty:
            return
        if dropped is not None:
            _LOG.warning("the recogniser is too slow: an utterance was dropped")
            self._done(dropped, "the recogniser was too slow")

    def _work(self) -> None:
        try:
            recognizer = self._make_recognizer()
        except LanguageError:
            _LOG.exception("the recogniser could not be loaded; nothing will be heard")
            return
        _LOG.info("listening with %s", recognizer.backend)
        while not self._stopping.is_set():
            segment = self._queue.get()
            if segment is None:
                return
            self._report()
            self._recognise(recognizer, segment)

    def _recognise(self, recognizer: Recognizer, segment: Segment) -> None:
        started = monotonic()
        try:
            heard = recognizer.transcribe(segment.samples, SAMPLE_RATE)
        except (LanguageError, RuntimeError) as error:
            _LOG.warning("recognition failed: %s", error)
            self._done(segment, f"recognition failed: {error}")
            return
        if heard.words:
            self._utterances += 1
            name = f"{self._options.session}-{self._utterances}"
            self._on_transcript(shifted_transcript(heard, segment.start_s, name, recognizer, monotonic() - started))
        self._done(segment, "" if heard.words else heard.reason)

    def _done(self, segment: Segment, rejection: str) -> None:
        with self._lock:
            if segment.start_s in self._waiting_since:
                self._waiting_since.remove(segment.start_s)
            if rejection:
                self._rejected += 1
                self._last_rejection = rejection
        self._report()

    def _report(self) -> None:
        """Report the status if it changed, and every second of sound."""
        stream = self._stream
        if stream is None:
            return
        with self._lock:
            if self._waiting_since:
                state, until = SpeechState.RECOGNISING, min(self._waiting_since)
            elif stream.in_speech:
                state, until = SpeechState.SPEECH, stream.open_since_s
            else:
                state, until = SpeechState.IDLE, stream.now_s
            status = SpeechStatus(until, state, self._rejected, self._last_rejection)
            last = self._reported
            same = last is not None and (last.state, last.rejected) == (status.state, status.rejected)
            if same and last is not None and abs(status.examined_until_s - last.examined_until_s) < 1.0:
                return
            self._reported = status
        self._on_status(status)
