# SPDX-License-Identifier: Apache-2.0
"""A stream of sound to transcripts: everything but taking the sound happens in a worker."""

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
from uncom_language.speech.endpointing.endpointer import Ended, EndpointerConfig, Heard, Opened, UtteranceStream
from uncom_language.speech.recognition.recognizer import Hearing, Recognizer
from uncom_language.speech.recognition.timestamps import shifted_transcript
from uncom_language.speech.speech_status import SpeechState, SpeechStatus
from uncom_language.types import Transcript

_LOG = logging.getLogger(__name__)
_SHORTEST_PAUSE_S = 0.12  # before that nobody asks whether the words are a whole sentence


@dataclass(frozen=True, slots=True)
class ListenerOptions:
    """Settings of the listener."""

    endpointer: EndpointerConfig
    session: str  # beginning of every utterance's id
    backlog_s: float = 120.0  # sound that may wait for the recogniser
    # How long a pause [s] ends an utterance, by its words so far; None: always the endpointer's hang-over.
    patience_s: Callable[[str], float] | None = None


@dataclass(frozen=True, slots=True)
class _Chunk:
    samples: FloatArray
    rate: int
    stamp_s: float

    @property
    def length_s(self) -> float:
        return self.samples.size / self.rate


class Listener:
    """Feeds sound to endpointer and recogniser, and reports transcripts and status.

    Speech is decoded while it arrives. `feed` never waits for that: chunks queue up, and when more than backlog_s wait
    the oldest are dropped and counted as rejected, so memory stays bounded. Callbacks come from the worker.
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
        self._waiting: deque[_Chunk] = deque()
        self._waiting_s = 0.0
        self._new_words: dict[str, str] = {}
        self._changed = threading.Condition()
        self._stopping = False
        self._stream: UtteranceStream | None = None
        self._rate = 0
        self._hearing: Hearing | None = None
        self._start_s = 0.0
        self._judged: dict[str, float] = {}
        self._utterances = 0
        self._rejected = 0
        self._last_rejection = ""
        self._reported: SpeechStatus | None = None
        self._thread = threading.Thread(target=self._work, name="recogniser", daemon=True)

    def start(self) -> None:
        """Start the worker, which loads the recogniser."""
        self._thread.start()

    def stop(self) -> None:
        """Let the worker end after what it is doing now."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)

    def feed(self, samples: npt.NDArray[np.generic], sample_rate: int, stamp_s: float) -> None:
        """Take a chunk whose first sample was heard at `stamp_s` [s].

        Raises:
            SoundFormatError: samples or a rate that cannot be used.
        """
        StreamResampler.check(sample_rate)
        chunk = _Chunk(as_float(samples), sample_rate, stamp_s)
        with self._changed:
            self._waiting.append(chunk)
            self._waiting_s += chunk.length_s
            if self._waiting_s > self._options.backlog_s:
                self._drop()
            self._changed.notify_all()

    def learn(self, words: Mapping[str, str]) -> None:
        """Let the recogniser know further words, word to pronunciation (empty: by spelling), from the next pause on."""
        with self._changed:
            self._new_words.update(words)
            self._changed.notify_all()

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until all sound that was fed is examined; whether that came true."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting, timeout_s)

    @property
    def idle(self) -> bool:
        """Whether all sound that was fed is examined and all new words are known."""
        with self._changed:
            return not self._waiting and not self._may_learn()

    def _drop(self) -> None:
        _LOG.warning("the recogniser is too slow: sound was dropped")
        while self._waiting_s > self._options.backlog_s and len(self._waiting) > 1:
            self._waiting_s -= self._waiting.popleft().length_s
        self._rejected += 1
        self._last_rejection = "the recogniser was too slow"

    def _work(self) -> None:
        try:
            recognizer = self._make_recognizer()
        except UncomError:
            _LOG.exception("the recogniser could not be loaded; nothing will be heard")
            return
        _LOG.info("listening with %s", recognizer.backend)
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._waiting or self._may_learn())
                if self._stopping:
                    return
                words = dict(self._new_words) if self._may_learn() else {}
                chunk = self._waiting[0] if self._waiting else None
            if words:
                self._learn(recognizer, words)
            if chunk is not None:
                self._examine(recognizer, chunk)
                with self._changed:  # only now: whoever waits until all is examined may go on
                    if self._waiting and self._waiting[0] is chunk:
                        self._waiting.popleft()
                        self._waiting_s -= chunk.length_s
                    self._changed.notify_all()

    def _may_learn(self) -> bool:
        """Whether there are new words and no utterance is being decoded."""
        return bool(self._new_words) and self._hearing is None

    def _learn(self, recognizer: Recognizer, words: Mapping[str, str]) -> None:
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

    def _examine(self, recognizer: Recognizer, chunk: _Chunk) -> None:
        if self._stream is None or chunk.rate != self._rate:
            if self._stream is not None and self._stream.in_speech:
                self._end(recognizer, self._stream.cut())
            self._stream = UtteranceStream(self._options.endpointer, chunk.rate)
            self._rate = chunk.rate
        for event in self._stream.events(chunk.samples, chunk.stamp_s):
            if isinstance(event, Opened):
                self._hearing, self._start_s = recognizer.open(), event.start_s
                self._judged.clear()
                self._hearing.feed(event.samples)
            elif isinstance(event, Heard) and self._hearing is not None:
                self._hearing.feed(event.samples)
                if self._is_over(self._stream.silent_s, self._hearing):
                    self._end(recognizer, self._stream.cut())
            elif isinstance(event, Ended):
                self._end(recognizer, event)
        self._report()

    def _is_over(self, silent_s: float, hearing: Hearing) -> bool:
        """Whether a pause is long enough for the words so far."""
        patience_s = self._options.patience_s
        if patience_s is None or silent_s < _SHORTEST_PAUSE_S:
            return False
        words = hearing.words_so_far()
        if words not in self._judged:
            self._judged[words] = patience_s(words)
        return silent_s >= self._judged[words]

    def _end(self, recognizer: Recognizer, ended: Ended) -> None:
        """Take what was heard, and report it unless it did not stand out of the background."""
        hearing, self._hearing = self._hearing, None
        if hearing is None:
            return
        self._report(SpeechState.RECOGNISING)
        started = monotonic()
        try:
            heard = hearing.finish()
        except (LanguageError, RuntimeError) as error:
            _LOG.warning("recognition failed: %s", error)
            self._reject(f"recognition failed: {error}")
            return
        if ended.segment is None:
            return
        if not heard.words:
            self._reject(heard.reason)
            return
        self._utterances += 1
        name = f"{self._options.session}-{self._utterances}"
        self._on_transcript(shifted_transcript(heard, self._start_s, name, recognizer, monotonic() - started))

    def _reject(self, reason: str) -> None:
        with self._changed:
            self._rejected += 1
            self._last_rejection = reason

    def _report(self, state: SpeechState | None = None) -> None:
        """Report the status if it changed, and every second of sound."""
        stream = self._stream
        if stream is None:
            return
        if state is None:
            state = SpeechState.SPEECH if stream.in_speech else SpeechState.IDLE
        until = stream.now_s if state is SpeechState.IDLE else self._start_s
        status = SpeechStatus(until, state, self._rejected, self._last_rejection)
        last = self._reported
        same = last is not None and (last.state, last.rejected) == (status.state, status.rejected)
        if same and last is not None and abs(status.examined_until_s - last.examined_until_s) < 1.0:
            return
        self._reported = status
        self._on_status(status)
