# SPDX-License-Identifier: Apache-2.0
"""Sound and video files, decoded to mono samples at 16 kHz."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from uncom_language.exceptions import SoundFileError
from uncom_language.speech.audio.samples import SAMPLE_RATE, FloatArray, as_float, resample


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
    samples = _read_with_libsndfile(file)
    if samples is None:
        samples = _read_with_ffmpeg(file)
    if samples.size == 0:
        raise SoundFileError(file, "it holds no sound")
    return samples


def _read_with_libsndfile(file: Path) -> FloatArray | None:
    """Read a file that libsndfile knows, None if it does not."""
    import soundfile  # noqa: PLC0415 - only files need it

    try:
        frames, rate = soundfile.read(str(file), dtype="float32", always_2d=True)
    except (soundfile.LibsndfileError, RuntimeError):
        return None
    return resample(as_float(frames), int(rate))


def _read_with_ffmpeg(file: Path) -> FloatArray:
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
