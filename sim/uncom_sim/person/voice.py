# SPDX-License-Identifier: Apache-2.0
"""The person's voice: eSpeak NG called directly, which gives the samples and the time of every word."""

from __future__ import annotations

import _ctypes
import ctypes
import functools
import re
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import espeakng_loader
import numpy as np
import numpy.typing as npt
import soxr

from uncom_sim.exceptions import VoiceError
from uncom_sim.person.options import VOICE
from uncom_sim.types import SAMPLE_RATE_HZ, SpokenWord

Samples = npt.NDArray[np.float64]

# Voices of different people that the default recogniser, whose acoustic model is American, can follow; eSpeak's other
# voices ("en+m1", "en-gb-x-rp") work by name and are misheard more often. After + comes the speaker variant.
VOICES = ("en-us", "en-us+m1", "en-us+m3", "en-us+m7", "en-us+f1", "en-us+f2", "en-us+f4", "en+f2")


class _Espeak(IntEnum):
    """Values of speak_lib.h."""

    AUDIO_OUTPUT_SYNCHRONOUS = 2
    CHARS_UTF8 = 1


class _Parameter(IntEnum):
    """Parameters of the voice, espeak_PARAMETER in speak_lib.h."""

    RATE = 1
    PITCH = 3


class _EventType(IntEnum):
    """Kinds of events, espeak_EVENT_TYPE in speak_lib.h."""

    LIST_TERMINATED = 0
    WORD = 1


_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Utterance:
    """A spoken sentence: samples at 16 kHz from -1 to 1, and its words with times from the first sample [s]."""

    samples: Samples
    words: tuple[SpokenWord, ...]

    @property
    def duration_s(self) -> float:
        """Length of the sound [s]."""
        return len(self.samples) / SAMPLE_RATE_HZ


class _Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", ctypes.c_char * 8),
    )


_CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event))


@functools.lru_cache(maxsize=64)
def speak(text: str, voice: str = "en-us", words_per_minute: float = 150.0, pitch: float = 50.0) -> Utterance:
    """Speak a sentence; the same arguments give the same samples, whatever was said before.

    Args:
        text: what to say; nothing to say gives no samples.
        voice: name of an eSpeak voice, optionally with a variant ("en-us+f2").
        words_per_minute: speed.
        pitch: 0 (deep) to 99 (high).

    Raises:
        VoiceError: eSpeak does not know the voice, or fails.
    """
    tokens = list(re.finditer(r"[^\s]+", text))
    if not any(re.search(r"\w", token.group()) for token in tokens):
        return Utterance(np.zeros(0), ())
    with _lock, _library() as (library, rate):
        raw, marks = _synthesize(library, text, voice, words_per_minute, pitch)
    samples = np.asarray(soxr.resample(raw, rate, SAMPLE_RATE_HZ))
    samples.flags.writeable = False
    starts = {position - 1: milliseconds / 1000.0 for position, milliseconds in marks}
    return Utterance(samples, _word_times(tokens, starts, samples))


@contextmanager
def _library() -> Iterator[tuple[ctypes.CDLL, int]]:
    """Load eSpeak anew; yields it and its sample rate [Hz].

    It keeps state that nothing resets, so that the same words would come out a trace different each time; a copy of
    the library has state of its own.
    """
    original = Path(espeakng_loader.get_library_path())
    try:
        with tempfile.TemporaryDirectory(prefix="uncom_voice_") as folder:
            library = ctypes.CDLL(shutil.copy(original, folder))
        rate = library.espeak_Initialize(
            _Espeak.AUDIO_OUTPUT_SYNCHRONOUS, 0, str(espeakng_loader.get_data_path()).encode(), 0
        )
    except OSError as err:
        raise VoiceError(f"eSpeak NG cannot be loaded: {err}") from err
    if rate <= 0:
        raise VoiceError("eSpeak NG found no voices; install espeakng-loader again")
    try:
        yield library, int(rate)
    finally:
        library.espeak_Terminate()
        if hasattr(_ctypes, "dlclose"):
            _ctypes.dlclose(library._handle)  # noqa: SLF001 (ctypes has no other way to let go of a library)


def _synthesize(
    library: ctypes.CDLL, text: str, voice: str, speed: float, pitch: float
) -> tuple[Samples, list[tuple[int, int]]]:
    chunks: list[npt.NDArray[np.int16]] = []
    marks: list[tuple[int, int]] = []

    def on_sound(wave: object, count: int, events: object) -> int:
        if wave and count > 0:
            chunks.append(np.ctypeslib.as_array(wave, shape=(count,)).copy())
        i = 0
        while events[i].type != _EventType.LIST_TERMINATED:  # type: ignore[index]
            if events[i].type == _EventType.WORD:  # type: ignore[index]
                marks.append((events[i].text_position, events[i].audio_position))  # type: ignore[index]
            i += 1
        return 0

    callback = _CALLBACK(on_sound)
    library.espeak_SetSynthCallback(callback)
    if library.espeak_SetVoiceByName(voice.encode()) != 0:
        raise VoiceError(f"eSpeak NG has no voice {voice!r}; voices that work here: {', '.join(VOICES)}")
    library.espeak_ng_SetRandSeed(1)
    library.espeak_SetParameter(_Parameter.RATE, round(speed), 0)
    library.espeak_SetParameter(_Parameter.PITCH, round(pitch), 0)
    encoded = text.encode() + b"\0"
    if library.espeak_Synth(encoded, len(encoded), 0, 1, 0, _Espeak.CHARS_UTF8, None, None) != 0:
        raise VoiceError("eSpeak NG could not speak the sentence")
    library.espeak_Synchronize()
    return np.concatenate([np.zeros(1, np.int16), *chunks]) / 32768.0, marks


def _word_times(tokens: list[re.Match[str]], starts: dict[int, float], samples: Samples) -> tuple[SpokenWord, ...]:
    """Give every word of the text its time; eSpeak sometimes runs words together and marks only the first."""
    loud = np.flatnonzero(np.abs(samples) > VOICE.silence)
    end = float(loud[-1] + 1) / SAMPLE_RATE_HZ if len(loud) else len(samples) / SAMPLE_RATE_HZ
    begins: list[float | None] = []
    for token in tokens:
        inside = [time for position, time in starts.items() if token.start() <= position < token.end()]
        begins.append(min(inside) if inside else None)
    known = [(i, time) for i, time in enumerate(begins) if time is not None]
    letters = np.concatenate([[0.0], np.cumsum([len(token.group()) + 1.0 for token in tokens])])
    anchors = [letters[i] for i, _ in known] + [letters[-1]]
    times = [time for _, time in known] + [end]
    at = np.interp(letters, anchors, times)
    return tuple(
        SpokenWord(
            token.group().strip(".,!?;:\"'"), float(at[i]), _end_of_sound(float(at[i]), float(at[i + 1]), samples)
        )
        for i, token in enumerate(tokens)
    )


def _end_of_sound(start: float, end: float, samples: Samples) -> float:
    """Take the silence before the next word off a word."""
    window = np.abs(samples[int(start * SAMPLE_RATE_HZ) : int(end * SAMPLE_RATE_HZ)])
    loud = np.flatnonzero(window > VOICE.silence)
    return end if len(loud) == 0 else start + float(loud[-1] + 1) / SAMPLE_RATE_HZ
