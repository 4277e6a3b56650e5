# SPDX-License-Identifier: Apache-2.0
"""Files of a PocketSphinx acoustic model, and variants of it with shifted Gaussian means."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from uncom_language.exceptions import RecognizerError

FloatArray = npt.NDArray[np.float32]
_MAGIC = 0x11223344
_END_OF_HEADER = b"endhdr\n"


@dataclass(frozen=True)
class Gaussians:
    """Means or variances of a phonetically tied model: (codebook, stream, density, dimension)."""

    values: FloatArray


def read_gaussians(path: Path) -> Gaussians:
    """Read a `means` or `variances` file.

    Raises:
        RecognizerError: not such a file, or of another byte order or layout.
    """
    data = path.read_bytes()
    start = data.find(_END_OF_HEADER) + len(_END_OF_HEADER)
    magic, codebooks, streams, densities = struct.unpack_from("<Iiii", data, start)
    if magic != _MAGIC:
        raise RecognizerError(f"{path} is no acoustic model of PocketSphinx in this machine's byte order")
    lengths = struct.unpack_from(f"<{streams}i", data, start + 16)
    if len(set(lengths)) != 1:
        raise RecognizerError(f"{path}: streams of different lengths are not supported")
    shape = (codebooks, streams, densities, lengths[0])
    first = start + 16 + 4 * streams + 4
    values = np.frombuffer(data, dtype="<f4", count=int(np.prod(shape)), offset=first).reshape(shape)
    return Gaussians(values.astype(np.float32))


def write_gaussians(gaussians: Gaussians, path: Path) -> None:
    """Write a `means` or `variances` file (without checksum)."""
    values = gaussians.values
    codebooks, streams, densities, length = values.shape
    head = struct.pack(f"<Iiii{streams}ii", _MAGIC, codebooks, streams, densities, *[length] * streams, values.size)
    path.write_bytes(b"s3\nversion 1.0\n" + _END_OF_HEADER + head + values.astype("<f4").tobytes())


def write_shift(shift: FloatArray, path: Path) -> None:
    """Write how far means move, in 8 bits a number (the rounding is far below a standard deviation)."""
    scale = np.abs(shift).max(axis=(0, 2, 3), keepdims=True) / 127.0
    np.savez_compressed(path, shift=np.rint(shift / scale).astype(np.int8), scale=scale.astype(np.float32))


def read_shift(path: Path) -> FloatArray:
    """Read how far means move: (codebook, stream, density, dimension)."""
    with np.load(path) as held:
        return np.asarray(held["shift"].astype(np.float32) * held["scale"], dtype=np.float32)


def make_shifted_model(model: Path, shift: FloatArray, folder: Path) -> Path:
    """Write into `folder` an acoustic model that is `model` with shifted means; the other files are linked.

    Raises:
        RecognizerError: the shift was made for another model.
    """
    means = read_gaussians(model / "means")
    if means.values.shape != shift.shape:
        raise RecognizerError(f"the voice adaptation was made for another acoustic model than {model}")
    for file in model.iterdir():
        if file.name != "means":
            (folder / file.name).symlink_to(file.resolve())
    write_gaussians(Gaussians(means.values + shift), folder / "means")
    return folder
