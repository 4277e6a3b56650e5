# SPDX-License-Identifier: Apache-2.0
"""Camera images small enough to keep: JPEG for colour, 16-bit PNG in millimetres for depth."""

from __future__ import annotations

import struct
from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from uncom_bringup.exceptions import BadInputError

Rgb = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]

JPEG_QUALITY = 92
# compressed_depth_image_transport puts a header before the PNG: a format code and two quantisation parameters,
# all unused for 16UC1.
_DEPTH_HEADER = struct.pack("<iff", 0, 0.0, 0.0)
_PNG_MAGIC = b"\x89PNG"
# Sensor noise leaves nothing to find for a search of repeats: Huffman codes alone are smaller and faster.
_DEPTH_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 2, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY]


def encode_jpeg(rgb: Rgb, quality: int = JPEG_QUALITY) -> bytes:
    """Encode RGB (H, W, 3)."""
    good, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not good:
        raise BadInputError("an image could not be written as JPEG")
    return bytes(data.tobytes())


def encode_png(rgb: Rgb) -> bytes:
    """Encode RGB (H, W, 3) without loss."""
    good, data = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 6])
    if not good:
        raise BadInputError("an image could not be written as PNG")
    return bytes(data.tobytes())


def decode_colour(data: bytes) -> Rgb:
    """Decode JPEG or PNG to RGB (H, W, 3).

    Raises:
        BadInputError: not an image.
    """
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
    if image is None:
        raise BadInputError("a compressed image is damaged or of an unknown format")
    return cast("Rgb", cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def encode_depth(depth: Depth) -> bytes:
    """Encode depth (H, W) [m] as compressedDepth does 16UC1: to 1 mm, at most 65.535 m, unknown (NaN) as 0."""
    millimetres = np.clip(np.nan_to_num(depth, nan=0.0, posinf=0.0, neginf=0.0) * 1000.0, 0.0, 65535.0)
    image = np.rint(millimetres).astype(np.uint16)
    good, data = cv2.imencode(".png", image, _DEPTH_PNG)
    if not good:
        raise BadInputError("a depth image could not be written as PNG")
    return _DEPTH_HEADER + bytes(data.tobytes())


def decode_depth(data: bytes) -> Depth:
    """Decode what `encode_depth` writes, or a plain 16-bit PNG, to metres (H, W); unknown is NaN.

    Raises:
        BadInputError: not a 16-bit image.
    """
    start = data.find(_PNG_MAGIC, 0, len(_DEPTH_HEADER) + len(_PNG_MAGIC))
    image = cv2.imdecode(np.frombuffer(data[start:], np.uint8), cv2.IMREAD_UNCHANGED) if start >= 0 else None
    if image is None or image.dtype != np.uint16 or image.ndim != 2:
        raise BadInputError("a compressed depth image is not a 16-bit PNG")
    depth: Depth = image.astype(np.float32) * np.float32(0.001)
    depth[image == 0] = np.nan
    return depth
