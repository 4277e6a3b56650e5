# SPDX-License-Identifier: Apache-2.0
"""Files of a PocketSphinx acoustic model (phonetically tied mixtures), and variants of it adapted to other voices."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from uncom_language.exceptions import RecognizerError

FloatArray = npt.NDArray[np.float32]
ByteArray = npt.NDArray[np.uint8]
_MAGIC = 0x11223344
_END_OF_HEADER = b"endhdr\n"
_ADAPTED_FILES = ("means", "variances", "sendump")
LOG_BASE = 1.0001  # of PocketSphinx's integer logarithms
# One step of a mixture weight's byte as a natural logarithm: PocketSphinx shifts its logarithms right by 10 bits.
WEIGHT_STEP = 1024.0 * float(np.log(LOG_BASE))


@dataclass(frozen=True)
class Gaussians:
    """Means or variances of a phonetically tied model: (codebook, stream, density, dimension)."""

    values: FloatArray


@dataclass(frozen=True)
class MixtureWeights:
    """Weights of a tied state's densities: (stream, density, state), in steps of WEIGHT_STEP below zero."""

    values: ByteArray
    header: bytes


@dataclass(frozen=True)
class Adaptation:
    """How a model differs from the one it was made from.

    Attributes:
        shift: what is added to the means.
        spread: natural logarithms of what the variances are multiplied by; shape as the means.
        states: numbers (K,) of the tied states whose mixture weights differ.
        weights: their weights (stream, density, K), as in MixtureWeights.
    """

    shift: FloatArray
    spread: FloatArray
    states: npt.NDArray[np.int64]
    weights: ByteArray


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


def read_weights(path: Path) -> MixtureWeights:
    """Read a `sendump` file: lines, each after its length, until a length of 0; numbers of states and densities; bytes.

    Raises:
        RecognizerError: not such a file, or with clustered weights.
    """
    data = path.read_bytes()
    lines: list[str] = []
    position = 0
    try:
        while True:
            (length,) = struct.unpack_from("<i", data, position)
            position += 4
            if length == 0:
                break
            lines.append(data[position : position + length].rstrip(b"\0").decode())
            position += length
        named = dict(line.rsplit(" ", 1) for line in lines if line.count(" ") == 1)
        densities, states = struct.unpack_from("<ii", data, position)
        streams = int(named["feature_count"])
        header, raw = data[: position + 8], np.frombuffer(data, np.uint8, offset=position + 8)
        if named.get("cluster_count", "0") != "0":
            raise RecognizerError(f"{path}: clustered mixture weights are not supported")
        return MixtureWeights(raw.reshape(streams, densities, states).copy(), header)
    except (struct.error, KeyError, ValueError) as error:
        raise RecognizerError(f"{path} holds no mixture weights of PocketSphinx that can be read") from error


def write_weights(weights: MixtureWeights, path: Path) -> None:
    """Write a `sendump` file."""
    path.write_bytes(weights.header + weights.values.tobytes())


def write_adaptation(adaptation: Adaptation, path: Path) -> None:
    """Write an adaptation, 8 bits a number (the rounding is far below a standard deviation)."""
    made: dict[str, npt.NDArray[np.generic]] = {"states": adaptation.states.astype(np.int16)}
    for name, values in (("shift", adaptation.shift), ("spread", adaptation.spread)):
        scale = np.maximum(np.abs(values).max(axis=(0, 2, 3), keepdims=True), 1e-9) / 127.0
        made[name] = np.rint(values / scale).astype(np.int8)
        made[f"{name}_scale"] = scale.astype(np.float32)
    np.savez_compressed(path, weights=adaptation.weights, **made)  # type: ignore[arg-type]  # its stub allows no names


def read_adaptation(path: Path) -> Adaptation:
    """Read an adaptation."""
    with np.load(path) as held:
        shift, spread = (held[name].astype(np.float32) * held[f"{name}_scale"] for name in ("shift", "spread"))
        return Adaptation(shift, spread, held["states"].astype(np.int64), held["weights"])


def make_adapted_model(model: Path, adaptation: Adaptation, folder: Path) -> Path:
    """Write into `folder` an adapted variant of an acoustic model; files that do not change are linked.

    Raises:
        RecognizerError: the adaptation was made for another model.
    """
    means, variances = read_gaussians(model / "means").values, read_gaussians(model / "variances").values
    weights = read_weights(model / "sendump")
    fits = means.shape == adaptation.shift.shape and weights.values.shape[:2] == adaptation.weights.shape[:2]
    if not fits or adaptation.states.max(initial=0) >= weights.values.shape[2]:
        raise RecognizerError(f"the voice adaptation was made for another acoustic model than {model}")
    for file in model.iterdir():
        if file.name not in _ADAPTED_FILES:
            (folder / file.name).symlink_to(file.resolve())
    write_gaussians(Gaussians(means + adaptation.shift), folder / "means")
    write_gaussians(Gaussians(variances * np.exp(adaptation.spread)), folder / "variances")
    weights.values[:, :, adaptation.states] = adaptation.weights
    write_weights(weights, folder / "sendump")
    return folder
