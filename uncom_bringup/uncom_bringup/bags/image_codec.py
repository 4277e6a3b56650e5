# SPDX-License-Identifier: Apache-2.0
"""Camera images small enough to keep: JPEG for colour, 16-bit PNG for depth, both as image_transport writes them.

Depth is kept as compressed_depth_image_transport keeps floats: as inverse depth, whose steps grow with distance as the
noise of a depth camera does. What differs by less than that noise is evened out first, which is what makes it small.
"""

from __future__ import annotations

import struct
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from uncom_bringup.bags.options import DEPTH, IMAGE, DepthOptions, ImageOptions
from uncom_bringup.exceptions import BadInputError

Rgb = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]

# compressed_depth_image_transport puts a header before the PNG: a format code and the two parameters of
# inverse = a / depth + b, both unused for 16UC1.
_HEADER = struct.Struct("<iff")
_PNG_MAGIC = b"\x89PNG"


def encode_jpeg(rgb: Rgb, quality: int = IMAGE.jpeg_quality) -> bytes:
    """Encode RGB (H, W, 3)."""
    good, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not good:
        raise BadInputError("an image could not be written as JPEG")
    return bytes(data.tobytes())


def encode_png(rgb: Rgb, options: ImageOptions = IMAGE) -> bytes:
    """Encode RGB (H, W, 3) without loss."""
    good, data = cv2.imencode(
        ".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, options.png_compression]
    )
    if not good:
        raise BadInputError("an image could not be written as PNG")
    return bytes(data.tobytes())


def decode_colour(data: bytes) -> Rgb:
    """Decode JPEG or PNG to RGB (H, W, 3).

    Raises:
        BadInputError: not an image.
    """
    image = _decoded(data, cv2.IMREAD_COLOR)
    if image is None:
        raise BadInputError("a compressed image is damaged or of an unknown format")
    return cast("Rgb", cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def _decoded(data: bytes, flags: int) -> npt.NDArray[np.uint8 | np.uint16] | None:
    """Return what OpenCV reads, None where it cannot, or will not as the picture claims to be larger than any is."""
    try:
        return cv2.imdecode(np.frombuffer(data, np.uint8), flags) if data else None
    except cv2.error:
        return None


def encode_depth(depth: Depth, options: DepthOptions = DEPTH) -> bytes:
    """Encode depth (H, W) [m], unknown (NaN) kept as such, as compressedDepth does 32FC1.

    Errors stay about as small as a structured-light camera's noise: some 2 mm at 1 m, growing with distance squared.
    """
    known = np.isfinite(depth) & (depth > 0.0)
    inverse = np.zeros(depth.shape, np.float32)
    np.divide(1.0, depth, out=inverse, where=known)
    known &= inverse < 65535.0 * options.step_per_m
    smooth = cv2.bilateralFilter(inverse, options.filter_window_px, options.noise_per_m, options.filter_reach_px)
    steps = np.where(known, smooth, 0.0).astype(np.float32) / np.float32(options.step_per_m)
    encoding = [
        cv2.IMWRITE_PNG_COMPRESSION,
        options.png_compression,
        cv2.IMWRITE_PNG_STRATEGY,
        cv2.IMWRITE_PNG_STRATEGY_FILTERED,
    ]
    good, data = cv2.imencode(".png", _round_steps(steps, options.hold_steps), encoding)
    if not good:
        raise BadInputError("a depth image could not be written as PNG")
    return _HEADER.pack(0, 1.0 / options.step_per_m, 0.0) + bytes(data.tobytes())


def _round_steps(steps: npt.NDArray[np.float32], hold_steps: float) -> npt.NDArray[np.uint16]:
    """Round (H, W) so that along a row a value stays as long as it is near enough; 0 stays 0."""
    columns = np.ascontiguousarray(steps.T)
    rounded = np.rint(columns)
    rounded[(columns > 0.0) & (rounded == 0.0)] = 1.0  # what is known stays known
    held = np.zeros(steps.shape[0], np.float32)
    away, changed = np.empty_like(held), np.empty(held.shape, bool)
    for now, whole in zip(columns, rounded, strict=True):
        np.abs(np.subtract(now, held, out=away), out=away)
        np.copyto(held, whole, where=np.greater(away, hold_steps, out=changed))
        held[whole == 0.0] = 0.0
        whole[:] = held
    return np.ascontiguousarray(rounded.T).astype(np.uint16)


def decode_depth(data: bytes, encoding: str = "") -> Depth:
    """Decode what compressed_depth_image_transport writes, or a plain 16-bit PNG, to metres (H, W); unknown is NaN.

    Args:
        data: header and PNG.
        encoding: what the message's format begins with: 32FC1 for inverse depth, else millimetres.

    Raises:
        BadInputError: not a 16-bit image.
    """
    start = data.find(_PNG_MAGIC, 0, _HEADER.size + len(_PNG_MAGIC))
    image = _decoded(data[start:], cv2.IMREAD_UNCHANGED) if start >= 0 else None
    if image is None or image.dtype != np.uint16 or image.shape[2:]:
        raise BadInputError("a compressed depth image is not a 16-bit PNG")
    known = image > 0
    depth: Depth = np.full(image.shape, np.nan, np.float32)
    if encoding.startswith("32FC1") and start == _HEADER.size:
        _, scale, offset = _HEADER.unpack_from(data)
        np.divide(np.float32(scale), image - np.float32(offset), out=depth, where=known)
    else:
        np.multiply(image, np.float32(0.001), out=depth, where=known)
    return depth
