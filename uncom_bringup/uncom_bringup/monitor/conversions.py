# SPDX-License-Identifier: Apache-2.0
"""Messages to compressed messages and plain values, and back."""

from __future__ import annotations

import importlib
import math
from collections.abc import Collection
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration, Time
from sensor_msgs.msg import CompressedImage, Image
from uncom_common.conversions import depth_from_msg, depth_to_msg, rgb_from_msg, rgb_to_msg, seconds_from_msg

from uncom_bringup.bags import image_codec
from uncom_bringup.exceptions import UnknownTypeError
from uncom_bringup.graph.topics import Form

_RGB_FORMAT = "rgb8; jpeg compressed bgr8"
_DEPTH_FORMAT = "32FC1; compressedDepth png"
COMPRESSED_FORMATS = {Form.IMAGE: _RGB_FORMAT, Form.DEPTH: _DEPTH_FORMAT}  # what the codec's bytes are
# Clouds and masks are large and say nothing to a reader.
HEAVY = frozenset({"cloud", "mask", "data"})


def message_class(type_name: str) -> Any:
    """Find the class of `package/msg/Name`.

    Raises:
        UnknownTypeError: it is not installed here.
    """
    package, _, name = type_name.partition("/")
    kind, _, name = name.rpartition("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind or 'msg'}"), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownTypeError(type_name) from error


def compressed_from_image(msg: Image, form: Form) -> CompressedImage:
    """Compress an image message: colour to JPEG (image_transport's `compressed`), depth to PNG (`compressedDepth`)."""
    if form is Form.DEPTH:
        return CompressedImage(
            header=msg.header, format=_DEPTH_FORMAT, data=image_codec.encode_depth(depth_from_msg(msg))
        )
    return CompressedImage(header=msg.header, format=_RGB_FORMAT, data=image_codec.encode_jpeg(rgb_from_msg(msg)))


def compressed_to_image(msg: CompressedImage) -> Image:
    """Undo `compressed_from_image` (depth comes back as 32FC1)."""
    data = bytes(msg.data)
    if "compressedDepth" in msg.format:
        return depth_to_msg(image_codec.decode_depth(data, msg.format), msg.header)
    return rgb_to_msg(image_codec.decode_colour(data), msg.header)


def plain_from_msg(msg: Any, skip: Collection[str] = HEAVY) -> Any:
    """Turn a message into what JSON can hold: dicts by field name, lists, numbers, strings.

    Times and durations become seconds; NaN and infinities become null; fields named in `skip` are left out.
    """
    if isinstance(msg, (Time, Duration)):
        return seconds_from_msg(msg)
    if hasattr(msg, "get_fields_and_field_types"):
        names = (name for name in msg.get_fields_and_field_types() if name not in skip)
        return {name: plain_from_msg(getattr(msg, name), skip) for name in names}
    if isinstance(msg, np.generic):
        msg = msg.item()
    if isinstance(msg, (str, bool, int)):
        return msg
    if isinstance(msg, float):
        return msg if math.isfinite(msg) else None
    return [plain_from_msg(item, skip) for item in msg]
