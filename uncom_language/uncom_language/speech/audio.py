# SPDX-License-Identifier: Apache-2.0
"""Samples: formats, channels, sample rates, sound files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import soxr

from uncom_language.exceptions import SoundFileError, SoundFormatError

SAMPLE_RATE = 16000  # [Hz] of everything after this file

Int16Array = npt.NDArray[np.int16]
FloatArray = npt.NDArray[np.float32]

# Sample formats of audio_common_msgs/AudioInfo, as numpy types and their full scale.
_FORMATS: dict[str, tuple[str, float, float]] = {
    "S16LE": ("<i2", 32768.0, 0.0),
    "S16BE": (">i2", 32768.0, 0.0),
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
        scaled = samples.astype(np.float32) / np.float32(32768.0)
    elif np.issubdtype(samples.dtype, np.floating):
        scaled = samples.astype(np.float32)
    else:
        raise SoundFormatError(f"samples are {samples.dtype}; give int16 or float32")
    if scaled.ndim == 2:
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


def missing_floor(samples: Int16Array, snr_db: float = 32.0) -> float:
    """Return the power of the noise that sound (N,) lacks to have a background `snr_db` below its speech; 0 if none."""
    frame = SAMPLE_RATE // 50
    usable = samples[: samples.size - samples.size % frame].astype(np.float64).reshape(-1, frame)
    if usable.shape[0] < 3:
        return 0.0
    power = np.mean(usable**2, axis=1)
    speech = float(np.mean(power[power >= np.percentile(power, 60)]))
    background = float(np.percentile(power, 10))
    return max(0.0, speech / float(10.0 ** (snr_db / 10.0)) - background)


def with_floor(samples: Int16Array, snr_db: float = 32.0) -> Int16Array:
    """Return sound (N,) with white noise `snr_db` below its speech, unless its own background is louder.

    Cepstral mean normalisation expects the background of a microphone; the perfect silence between synthesised or
    gated words would distort it (measured: without it every second word of clean synthetic speech is lost).
    """
    missing = missing_floor(samples, snr_db)
    if missing <= 0.0:
        return samples
    noise = np.random.default_rng(0).standard_normal(samples.size) * np.sqrt(missing)
    return np.asarray(np.clip(np.rint(samples + noise), -32768, 32767), dtype=np.int16)


class StreamResampler:
    """Resamples a stream chunk by chunk; the sum is the same whatever the chunks' sizes."""

    def __init__(self, sample_rate: int) -> None:
        """Prepare for `sample_rate` [Hz].

        Raises:
            SoundFormatError: not a usable rate.
        """
        self.check(sample_rate)
        self.sample_rate = sample_rate
        self._stream = (
            None if sample_rate == SAMPLE_RATE else soxr.ResampleStream(sample_rate, SAMPLE_RATE, 1, dtype="float32")
        )

    @staticmethod
    def check(sample_rate: int) -> None:
        """Complain about a rate [Hz] that cannot be used.

        Raises:
            SoundFormatError: not a usable rate.
        """
        if not 1000 <= sample_rate <= 400_000:
            raise SoundFormatError(f"a sample rate of {sample_rate} Hz cannot be used; 1000 to 400000 can")

    def feed(self, samples: FloatArray) -> FloatArray:
        """Return what is ready at 16 kHz."""
        if self._stream is None:
            return samples
        return np.asarray(self._stream.resample_chunk(samples), dtype=np.float32)


def read_sound(path: str | Path) -> FloatArray:
    """Read a sound or video file (WAV, FLAC, OGG, MP3, MP4 and whatever FFmpeg reads) as mono 16 kHz (N,).

    Raises:
        SoundFileError: missing, unreadable, without sound, or empty.
    """
    file = Path(path)
    if not file.exists():
        raise SoundFileError(file, "there is no such file")
    if file.is_dir():
        raise SoundFileError(file, "it is a folder")
    if file.stat().st_size == 0:
        raise SoundFileError(file, "the file is empty")
    samples = _read_plain(file)
    if samples is None:
        samples = _read_container(file)
    if samples.size == 0:
        raise SoundFileError(file, "it holds no sound")
    return samples


def _read_plain(file: Path) -> FloatArray | None:
    """Read a file that libsndfile knows, None if it does not."""
    import soundfile  # noqa: PLC0415 - only files need it

    try:
        frames, rate = soundfile.read(str(file), dtype="float32", always_2d=True)
    except (soundfile.LibsndfileError, RuntimeError):
        return None
    return resample(as_float(frames), int(rate))


def _read_container(file: Path) -> FloatArray:
    """Read the first audio track of a container."""
    import av  # noqa: PLC0415 - only films need it

    pieces: list[FloatArray] = []
    try:
        with av.open(str(file)) as container:
            if not container.streams.audio:
                raise SoundFileError(file, "it has no audio track")
            resampler = av.AudioResampler(format="flt", layout="mono", rate=SAMPLE_RATE)
            for frame in container.decode(audio=0):
                pieces.extend(made.to_ndarray()[0] for made in resampler.resample(frame))
            pieces.extend(made.to_ndarray()[0] for made in resampler.resample(None))
    except (av.FFmpegError, ValueError) as error:
        raise SoundFileError(file, "its format is not known or it is damaged") from error
    return np.concatenate(pieces).astype(np.float32) if pieces else np.zeros(0, np.float32)
