# SPDX-License-Identifier: Apache-2.0
"""Test helper: speech made with eSpeak NG through ctypes, with the true word times."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache

import espeakng_loader
import numpy as np
import soxr

_WORD, _END = 1, 5


class _Id(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Id),
    ]


_CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event))


@dataclass(frozen=True)
class Spoken:
    """Samples int16 mono 16 kHz and the start [s] of every word."""

    samples: np.ndarray
    starts: tuple[float, ...]


class _Synthesiser:
    def __init__(self):
        self.lib = ctypes.CDLL(espeakng_loader.get_library_path())
        data = str(espeakng_loader.get_data_path()).encode()
        self.rate = self.lib.espeak_Initialize(2, 0, data, 0)
        self.chunks, self.words = [], []
        self.callback = _CALLBACK(self._collect)
        self.lib.espeak_SetSynthCallback(self.callback)

    def _collect(self, wav, count, events):
        if wav and count > 0:
            self.chunks.append(np.ctypeslib.as_array(wav, shape=(count,)).copy())
        index = 0
        while events[index].type != 0:
            if events[index].type == _WORD:
                self.words.append(events[index].audio_position / 1000.0)
            index += 1
        return 0

    def say(self, text, voice, speed, pitch):
        self.chunks.clear()
        self.words.clear()
        if self.lib.espeak_SetVoiceByName(voice.encode()) != 0:
            raise ValueError(f"no voice {voice}")
        self.lib.espeak_SetParameter(1, speed, 0)
        self.lib.espeak_SetParameter(3, pitch, 0)
        data = text.encode()
        self.lib.espeak_Synth(data, len(data) + 1, 0, 1, 0, 1, None, None)
        self.lib.espeak_Synchronize()
        return np.concatenate(self.chunks), tuple(self.words)


@cache
def _synthesiser():
    return _Synthesiser()


def say(text, voice="en-us", speed=150, pitch=50, lead_s=0.5, tail_s=1.0, snr_db=None, seed=0):
    """Speak a text: silence, words, silence; noise is relative to the speech's own power."""
    samples, starts = _synthesiser().say(text, voice, speed, pitch)
    wave = soxr.resample(samples.astype(np.float32), _synthesiser().rate, 16000)
    power = float(np.mean(wave**2))
    wave = np.concatenate([np.zeros(round(16000 * lead_s)), wave, np.zeros(round(16000 * tail_s))])
    if snr_db is not None:
        rng = np.random.default_rng(seed)
        wave = wave + rng.standard_normal(wave.size) * np.sqrt(power / 10 ** (snr_db / 10))
    return Spoken(np.clip(wave, -32768, 32767).astype(np.int16), tuple(lead_s + start for start in starts))
