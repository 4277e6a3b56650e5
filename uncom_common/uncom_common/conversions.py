# SPDX-License-Identifier: Apache-2.0
"""Common messages to values and back, in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import ImageFormatError, UnknownPrimitiveError
from uncom_common.primitive import Primitive
from uncom_common.transforms import (
    FloatArray,
    StampedTransform,
    matrices_from_poses,
    matrix_from_pose,
    pose_from_matrix,
)
from uncom_interfaces.msg import Command

_PRIMITIVE_NUMBERS = {p: int(getattr(Command, f"PRIMITIVE_{p.name}")) for p in Primitive}
_PRIMITIVES = {number: primitive for primitive, number in _PRIMITIVE_NUMBERS.items()}


def seconds_from_msg(msg: Time | Duration) -> float:
    """Read a time or a duration as seconds."""
    return float(msg.sec) + 1e-9 * float(msg.nanosec)


def time_to_msg(seconds: float) -> Time:
    """Write seconds as a time; negative times (before the epoch) become 0."""
    nanoseconds = max(0, round(seconds * 1e9))
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def duration_to_msg(seconds: float) -> Duration:
    """Write seconds as a duration."""
    nanoseconds = round(seconds * 1e9)
    return Duration(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def header_to_msg(stamp_s: float, frame_id: str) -> Header:
    """Write a header."""
    return Header(stamp=time_to_msg(stamp_s), frame_id=frame_id)


def point_to_msg(point: npt.ArrayLike) -> Point:
    """Write a point (3,)."""
    x, y, z = np.asarray(point, dtype=float)
    return Point(x=x, y=y, z=z)


def vector_to_msg(vector: npt.ArrayLike) -> Vector3:
    """Write a vector (3,)."""
    x, y, z = np.asarray(vector, dtype=float)
    return Vector3(x=x, y=y, z=z)


def vector_from_msg(msg: Point | Vector3) -> FloatArray:
    """Read a point or vector as (3,)."""
    return np.array([msg.x, msg.y, msg.z])


def matrix_from_pose_msg(msg: Pose) -> FloatArray:
    """Read a pose as a (4, 4) transform from the pose's own frame to the frame it is given in."""
    q = msg.orientation
    return matrix_from_pose(vector_from_msg(msg.position), (q.x, q.y, q.z, q.w))


def pose_to_msg(matrix: npt.ArrayLike) -> Pose:
    """Write a (4, 4) transform as a pose."""
    position, (x, y, z, w) = pose_from_matrix(matrix)
    msg = Pose(position=point_to_msg(position))
    msg.orientation.x, msg.orientation.y, msg.orientation.z, msg.orientation.w = x, y, z, w
    return msg


def stamped_transform_from_msg(msg: TransformStamped) -> StampedTransform:
    """Read a stamped transform."""
    return stamped_transforms_from_msg((msg,))[0]


def stamped_transforms_from_msg(msgs: Sequence[TransformStamped]) -> tuple[StampedTransform, ...]:
    """Read the transforms of a tf message; all at once, since a robot sends some sixty of them fifty times a second."""
    if not msgs:
        return ()
    moves = [msg.transform for msg in msgs]
    matrices = matrices_from_poses(
        np.array([(t.translation.x, t.translation.y, t.translation.z) for t in moves]),
        np.array([(t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w) for t in moves]),
    )
    return tuple(
        StampedTransform(seconds_from_msg(msg.header.stamp), msg.header.frame_id, msg.child_frame_id, matrix)
        for msg, matrix in zip(msgs, matrices, strict=True)
    )


def stamped_transform_to_msg(transform: StampedTransform) -> TransformStamped:
    """Write a stamped transform."""
    position, (x, y, z, w) = pose_from_matrix(transform.matrix)
    msg = TransformStamped(header=header_to_msg(transform.stamp_s, transform.parent), child_frame_id=transform.child)
    msg.transform.translation = vector_to_msg(position)
    rotation = msg.transform.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = x, y, z, w
    return msg


def camera_from_msg(msg: CameraInfo) -> PinholeCamera:
    """Read the intrinsics of a camera whose images are rectified (or hardly distorted, as the robot's head camera)."""
    return PinholeCamera(int(msg.width), int(msg.height), msg.k[0], msg.k[4], msg.k[2], msg.k[5])


def camera_to_msg(camera: PinholeCamera, header: Header) -> CameraInfo:
    """Write intrinsics with no distortion."""
    c = camera
    return CameraInfo(
        header=header,
        width=c.width,
        height=c.height,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


# Encodings of sensor_msgs/Image with 8 bits a channel, by the names of their channels.
_CHANNELS = {f"{channels}8": channels for channels in ("rgb", "bgr", "rgba", "bgra")} | {"mono8": "l"}


def rgb_from_msg(msg: Image) -> npt.NDArray[np.uint8]:
    """Read a colour image as RGB (H, W, 3) uint8.

    Raises:
        ImageFormatError: an encoding other than rgb8, bgr8, rgba8, bgra8 or mono8, or too few bytes.
    """
    channels = _CHANNELS.get(msg.encoding)
    if channels is None:
        raise ImageFormatError(f"image encoding {msg.encoding!r} is not one of {', '.join(_CHANNELS)}")
    rows = _rows(msg, np.dtype(np.uint8), len(channels))
    image = rows.reshape(msg.height, msg.width, len(channels))
    if len(channels) == 1:
        return np.repeat(image, 3, axis=2)
    return np.ascontiguousarray(image[..., :3] if msg.encoding.startswith("rgb") else image[..., 2::-1])


def rgb_to_msg(image: npt.NDArray[np.uint8], header: Header) -> Image:
    """Write an RGB image (H, W, 3) uint8 as rgb8."""
    height, width, _ = image.shape
    msg = Image(header=header, height=height, width=width, encoding="rgb8", step=3 * width)
    msg.data = np.ascontiguousarray(image).tobytes()
    return msg


def depth_from_msg(msg: Image) -> npt.NDArray[np.float32]:
    """Read a depth image (REP 118: 32FC1 metres or 16UC1 millimetres) as metres (H, W); unknown is NaN.

    Raises:
        ImageFormatError: another encoding, or too few bytes.
    """
    if msg.encoding == "32FC1":
        depth = _rows(msg, np.dtype(np.float32), 1).astype(np.float32)
    elif msg.encoding in ("16UC1", "mono16"):
        depth = _rows(msg, np.dtype(np.uint16), 1).astype(np.float32) * np.float32(0.001)
    else:
        raise ImageFormatError(f"depth encoding {msg.encoding!r} is neither 32FC1 nor 16UC1")
    depth[~np.isfinite(depth) | (depth <= 0.0)] = np.nan
    return depth


def depth_to_msg(depth: npt.NDArray[np.float32], header: Header) -> Image:
    """Write depth (H, W) [m] as 32FC1."""
    height, width = depth.shape
    msg = Image(header=header, height=height, width=width, encoding="32FC1", step=4 * width)
    msg.data = np.ascontiguousarray(depth, dtype=np.float32).tobytes()
    return msg


def _rows(msg: Image, dtype: np.dtype[np.generic], channels: int) -> npt.NDArray[Any]:
    """Return the pixels (H, W * channels) of a message, its row padding removed."""
    used = msg.width * channels * dtype.itemsize
    step = msg.step or used
    data = np.frombuffer(msg.data, dtype=np.uint8)
    if step < used or data.size < step * msg.height or msg.height == 0 or msg.width == 0:
        raise ImageFormatError(f"image {msg.width}x{msg.height} {msg.encoding} holds only {data.size} bytes")
    return np.ascontiguousarray(data[: step * msg.height].reshape(msg.height, step)[:, :used]).view(
        dtype.newbyteorder(">" if msg.is_bigendian else "<")
    )


def cloud_from_msg(msg: PointCloud2) -> npt.NDArray[np.float32]:
    """Read the points (N, 3) [m] of a cloud written by cloud_to_msg."""
    count = msg.width * msg.height
    return np.frombuffer(msg.data, dtype=np.float32).reshape(count, 3).copy() if count else np.zeros((0, 3), np.float32)


def cloud_to_msg(points: npt.ArrayLike, header: Header) -> PointCloud2:
    """Write points (N, 3) [m] as a cloud of x y z float32."""
    data = np.ascontiguousarray(points, dtype=np.float32).reshape(-1, 3)
    fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")]
    msg = PointCloud2(header=header, height=1, width=len(data), fields=fields, point_step=12, is_dense=True)
    msg.row_step = 12 * len(data)
    msg.data = data.tobytes()
    return msg


def primitive_to_msg(primitive: Primitive) -> int:
    """Write a primitive as the constant of Command.msg that has its name."""
    return _PRIMITIVE_NUMBERS[primitive]


def primitive_from_msg(number: int) -> Primitive:
    """Read a constant PRIMITIVE_... of Command.msg.

    Raises:
        UnknownPrimitiveError: it is none of them.
    """
    if number not in _PRIMITIVES:
        raise UnknownPrimitiveError(number, (f"{n} {p.name}" for n, p in sorted(_PRIMITIVES.items())))
    return _PRIMITIVES[number]
