# SPDX-License-Identifier: Apache-2.0
"""Sample formats, channels and sample rates."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import soxr

from uncom_language.exceptions import SoundFormatError
from uncom_language.speech.audio.options import RESAMPLER

SAMPLE_RATE = 16000  # [Hz] of all sound behind this module

INT16_SCALE = 32768.0  # full scale of 16 bit samples

Int16Array = npt.NDArray[np.int16]
FloatArray = npt.NDArray[np.float32]

# Sample formats of audio_common_msgs/AudioInfo, as numpy types, full scale and offset.
_FORMATS: dict[str, tuple[str, float, float]] = {
    "S16LE": ("<i2", INT16_SCALE, 0.0),
    "S16BE": (">i2", INT16_SCALE, 0.0),
    "S32LE": ("<i4", 2147483648.0, 0.0),
    "S32BE": (">i4", 2147483648.0, 0.0),
    "F32LE": ("<f4", 1.0, 0.0),
    "F32BE": (">f4", 1.0, 0.0),
    "S8": ("i1", 128.0, 0.0),
    "U8": ("u1", 128.0, 128.0),
}


def decode_samples(data: bytes, sample_format: str, channels: int) -> FloatArray:
    """Read interleaved samples of a message as mono (N,) within -1..1; an incomplete last frame is dropped.

    Raises:
        SoundFormatError: a format that is not known, or no channel.
    """
    if sample_format not in _FORMATS:
        raise SoundFormatError(f"sample format {sample_format!r} is not one of {', '.join(_FORMATS)}")
    if channels < 1:
        raise SoundFormatError(f"sound with {channels} channels cannot be used")
    dtype, scale, offset = _FORMATS[sample_format]
    usable = len(data) - len(data) % (np.dtype(dtype).itemsize * channels)
    frames = np.frombuffer(data[:usable], dtype=dtype).astype(np.float32).reshape(-1, channels)
    return np.ascontiguousarray(((frames - offset) / scale).mean(axis=1), dtype=np.float32)


def as_float(samples: npt.NDArray[np.generic]) -> FloatArray:
    """Return samples (N,) or (N, channels) as mono float32 within -1..1.

    Raises:
        SoundFormatError: neither int16 nor floating point, or of another shape.
    """
    if samples.ndim not in (1, 2):
        raise SoundFormatError(f"samples have shape {samples.shape}; give (N,) or (N, channels)")
    if samples.dtype == np.int16:
        scaled = samples.astype(np.float32) / np.float32(INT16_SCALE)
    elif np.issubdtype(samples.dtype, np.floating):
        scaled = samples.astype(np.float32)
    else:
        raise SoundFormatError(f"samples are {samples.dtype}; give int16 or float32")
    if scaled.ndim > 1:
        scaled = scaled.mean(axis=1, dtype=np.float32)
    return np.asarray(np.nan_to_num(scaled), dtype=np.float32)


def to_int16(samples: FloatArray) -> Int16Array:
    """Return samples within -1..1 as 16 bit integers; what is beyond is clipped."""
    return np.asarray(np.clip(np.rint(samples * 32767.0), -32768, 32767), dtype=np.int16)


def resample(samples: FloatArray, sample_rate: int) -> FloatArray:
    """Return a whole recording at 16 kHz."""
    if sample_rate == SAMPLE_RATE:
        return samples
    return np.asarray(soxr.resample(samples, sample_rate, SAMPLE_RATE), dtype=np.float32)


class StreamResampler:
    """Resamples a stream chunk by chunk; the sum is the same whatever the chunks' sizes."""

    def __init__(self, sample_rate: int) -> None:
        """Prepare for `sample_rate` [Hz].

        Raises:
            SoundFormatError: not a usable rate.
        """
        self.check_sample_rate(sample_rate)
        self.sample_rate = sample_rate
        self._stream = (
            None if sample_rate == SAMPLE_RATE else soxr.ResampleStream(sample_rate, SAMPLE_RATE, 1, dtype="float32")
        )

    @staticmethod
    def check_sample_rate(sample_rate: int) -> None:
        """Refuse a sample rate [Hz] that cannot be used.

        Raises:
            SoundFormatError: not a usable rate.
        """
        low_hz, high_hz = RESAMPLER.min_rate_hz, RESAMPLER.max_rate_hz
        if not low_hz <= sample_rate <= high_hz:
            raise SoundFormatError(f"a sample rate of {sample_rate} Hz cannot be used; {low_hz} to {high_hz} can")

    def feed(self, samples: FloatArray) -> FloatArray:
        """Return what is ready at 16 kHz."""
        if self._stream is None:
            return samples
        return np.asarray(self._stream.resample_chunk(samples), dtype=np.float32)
