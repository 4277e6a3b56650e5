# SPDX-License-Identifier: Apache-2.0
"""Messages of seeing to values and back, in pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import Point, Point32, Polygon
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header
from uncom_common.conversions import (
    cloud_from_msg,
    cloud_to_msg,
    header_to_msg,
    matrix_from_pose_msg,
    point_to_msg,
    pose_to_msg,
    seconds_from_msg,
    vector_from_msg,
    vector_to_msg,
)

from uncom_interfaces.msg import Attribute as AttributeMsg
from uncom_interfaces.msg import Detection as DetectionMsg
from uncom_interfaces.msg import Hand as HandMsg
from uncom_interfaces.msg import Hands as HandsMsg
from uncom_interfaces.msg import MaskRle as MaskMsg
from uncom_interfaces.msg import ObjectPose, ObjectPoses
from uncom_interfaces.msg import PointingRay as RayMsg
from uncom_interfaces.msg import TableSurface as TableMsg
from uncom_interfaces.srv import Detect
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.types import (
    Attribute,
    Box,
    Detection,
    Geometry,
    Hand,
    HandsFrame,
    Mask,
    MetricRay,
    ObjectModel,
    PointingRay,
    Scene,
    TableSurface,
)

FloatArray = npt.NDArray[np.float64]


def mask_to_msg(mask: Mask) -> MaskMsg:
    """Write a mask (H, W) as run lengths, row by row, starting with a run of zeros."""
    height, width = mask.shape
    flat = np.concatenate([[False], np.asarray(mask, dtype=bool).ravel()])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    counts = np.diff(np.concatenate([[0], changes, [mask.size]])).astype(np.uint32)
    msg = MaskMsg(height=height, width=width)
    msg.counts = counts.tolist()
    return msg


def mask_from_msg(msg: MaskMsg) -> Mask:
    """Read a mask (H, W).

    Raises:
        InvalidImageError: the runs do not fill the mask.
    """
    counts = np.asarray(msg.counts, dtype=np.int64)
    size = int(msg.height) * int(msg.width)
    if int(counts.sum()) != size:
        raise InvalidImageError(f"a mask of {msg.width}x{msg.height} px has runs for {int(counts.sum())} px")
    values = np.arange(len(counts)) % 2 == 1
    return np.asarray(np.repeat(values, counts).reshape(msg.height, msg.width), dtype=bool)


def ray_to_msg(ray: PointingRay) -> RayMsg:
    """Write a pointing ray."""
    msg = RayMsg(sigma_rad=float(ray.sigma_rad), style=ray.style, metric=ray.metric is not None)
    msg.origin_u, msg.origin_v = ray.origin
    msg.tip_u, msg.tip_v = ray.tip
    msg.direction_u, msg.direction_v = ray.direction
    if ray.metric is not None:
        msg.origin, msg.tip = point_to_msg(ray.metric.origin), point_to_msg(ray.metric.tip)
        msg.direction = vector_to_msg(ray.metric.direction)
    return msg


def ray_from_msg(msg: RayMsg) -> PointingRay:
    """Read a pointing ray."""
    metric = None
    if msg.metric:
        metric = MetricRay(vector_from_msg(msg.origin), vector_from_msg(msg.tip), vector_from_msg(msg.direction))
    return PointingRay(
        (msg.origin_u, msg.origin_v),
        (msg.tip_u, msg.tip_v),
        (msg.direction_u, msg.direction_v),
        msg.sigma_rad,
        metric,
        msg.style,
    )


def hands_to_msg(frame: HandsFrame) -> HandsMsg:
    """Write the hands of one image."""
    msg = HandsMsg(
        header=header_to_msg(frame.stamp_s, frame.frame_id),
        width=frame.width,
        height=frame.height,
        pointing_hand=-1 if frame.pointing_hand is None else frame.pointing_hand,
        backend=frame.backend,
        latency_s=float(frame.latency_s),
    )
    for hand in frame.hands:
        item = HandMsg(
            handedness=hand.handedness,
            score=float(hand.score),
            landmarks=[point_to_msg(mark) for mark in hand.landmarks],
            depth_m=float(hand.depth_m),
            pointing=hand.pointing,
        )
        if hand.ray is not None:
            item.ray = ray_to_msg(hand.ray)
        msg.hands.append(item)
    return msg


def hands_from_msg(msg: HandsMsg) -> HandsFrame:
    """Read the hands of one image."""
    hands = tuple(
        Hand(
            item.handedness,
            item.score,
            np.array([[p.x, p.y, p.z] for p in item.landmarks]),
            ray_from_msg(item.ray) if item.pointing else None,
            item.depth_m,
        )
        for item in msg.hands
    )
    pointing = msg.pointing_hand if 0 <= msg.pointing_hand < len(hands) else None
    stamp = seconds_from_msg(msg.header.stamp)
    return HandsFrame(stamp, msg.header.frame_id, msg.width, msg.height, hands, pointing, msg.backend, msg.latency_s)


def detection_to_msg(detection: Detection, header: Header | None = None) -> DetectionMsg:
    """Write a detection; the header is for its cloud."""
    d = detection
    msg = DetectionMsg(id=d.id, label=d.label, score=float(d.score), mask=mask_to_msg(d.mask))
    msg.x_min, msg.y_min, msg.x_max, msg.y_max = (
        float(v) for v in (d.box.x_min, d.box.y_min, d.box.x_max, d.box.y_max)
    )
    if d.geometry is not None:
        msg.has_geometry = True
        msg.centroid = point_to_msg(d.geometry.centroid)
        msg.pose = pose_to_msg(d.geometry.pose)
        msg.size = vector_to_msg(d.geometry.size)
        msg.cloud = cloud_to_msg(d.geometry.cloud, header if header is not None else Header())
    msg.track = d.track
    if d.model is not None:
        msg.has_model, msg.model_pose = True, pose_to_msg(d.model.pose)
        msg.model_mesh = mesh_to_msg(d.model.vertices, d.model.triangles)
    msg.attributes = [AttributeMsg(name=a.name, value=a.value, probability=float(a.probability)) for a in d.attributes]
    msg.phrase_scores = [float(s) for s in d.phrase_scores]
    return msg


def mesh_to_msg(vertices: npt.ArrayLike, triangles: npt.ArrayLike) -> Mesh:
    """Write a mesh of vertices (N, 3) [m] and triangles (M, 3) of their indices."""
    corners = np.asarray(triangles, dtype=np.uint32).reshape(-1, 3)
    places = np.asarray(vertices, dtype=float).reshape(-1, 3)
    return Mesh(
        vertices=[point_to_msg(vertex) for vertex in places],
        triangles=[MeshTriangle(vertex_indices=corner) for corner in corners],
    )


def mesh_from_msg(msg: Mesh) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Read a mesh: vertices (N, 3) [m] and triangles (M, 3)."""
    vertices = np.array([[v.x, v.y, v.z] for v in msg.vertices], dtype=float).reshape(-1, 3)
    triangles = np.array([t.vertex_indices for t in msg.triangles], dtype=np.int64).reshape(-1, 3)
    return vertices, triangles


def models_from_msg(msg: ObjectPoses) -> tuple[ObjectModel, ...]:
    """Read the poses of an outside estimator, in the frame that the message names."""
    return tuple(
        ObjectModel(item.label, float(item.score), matrix_from_pose_msg(item.pose), *mesh_from_msg(item.mesh))
        for item in msg.poses
    )


def models_to_msg(models: Sequence[ObjectModel], header: Header, backend: str = "") -> ObjectPoses:
    """Write the poses of an outside estimator."""
    msg = ObjectPoses(header=header, backend=backend)
    for model in models:
        item = ObjectPose(label=model.label, score=float(model.score), pose=pose_to_msg(model.pose))
        item.mesh = mesh_to_msg(model.vertices, model.triangles)
        msg.poses.append(item)
    return msg


def detection_from_msg(msg: DetectionMsg) -> Detection:
    """Read a detection."""
    geometry = None
    if msg.has_geometry:
        geometry = Geometry(
            vector_from_msg(msg.centroid),
            matrix_from_pose_msg(msg.pose),
            vector_from_msg(msg.size),
            cloud_from_msg(msg.cloud),
        )
    model = None
    if msg.has_model:
        model = ObjectModel("", 1.0, matrix_from_pose_msg(msg.model_pose), *mesh_from_msg(msg.model_mesh))
    return Detection(
        msg.id,
        msg.label,
        msg.score,
        Box(msg.x_min, msg.y_min, msg.x_max, msg.y_max),
        mask_from_msg(msg.mask),
        geometry,
        tuple(Attribute(a.name, a.value, a.probability) for a in msg.attributes),
        tuple(msg.phrase_scores),
        msg.track,
        model,
    )


def polygon_to_msg(points: npt.ArrayLike) -> Polygon:
    """Write an outline (N, 3) or (N, 2)."""
    corners = np.asarray(points, dtype=float)
    return Polygon(
        points=[Point32(x=float(c[0]), y=float(c[1]), z=float(c[2]) if len(c) >= len("xyz") else 0.0) for c in corners]
    )


def polygon_from_msg(msg: Polygon) -> FloatArray:
    """Read an outline as (N, 3)."""
    return np.array([[p.x, p.y, p.z] for p in msg.points]).reshape(-1, 3)


def table_to_msg(table: TableSurface | None) -> TableMsg:
    """Write a table; None is one that was not found."""
    if table is None:
        return TableMsg(found=False)
    msg = TableMsg(found=True, normal=vector_to_msg(table.normal))
    msg.polygon = polygon_to_msg(table.polygon)
    msg.image_polygon = polygon_to_msg(table.image_polygon)
    msg.height = table.height_m if len(table.polygon) else 0.0
    return msg


def table_from_msg(msg: TableMsg) -> TableSurface | None:
    """Read a table."""
    if not msg.found:
        return None
    image = polygon_from_msg(msg.image_polygon)[:, :2]
    return TableSurface(polygon_from_msg(msg.polygon), vector_from_msg(msg.normal), image)


def scene_to_response(scene: Scene, response: Detect.Response | None = None) -> Detect.Response:
    """Write a scene as the answer to /uncom/detect."""
    response = Detect.Response() if response is None else response
    response.success = True
    response.header = header_to_msg(scene.stamp_s, scene.frame_id)
    response.detections = [detection_to_msg(d, response.header) for d in scene.detections]
    response.phrase_none = [float(p) for p in scene.phrase_none]
    response.table = table_to_msg(scene.table)
    response.vanished_tracks, response.moved_tracks = list(scene.vanished_tracks), list(scene.moved_tracks)
    response.backend = scene.backend
    response.latency_s = float(scene.latency_s)
    return response


def scene_from_response(response: Detect.Response) -> Scene:
    """Read the answer of /uncom/detect."""
    return Scene(
        seconds_from_msg(response.header.stamp),
        response.header.frame_id,
        tuple(detection_from_msg(d) for d in response.detections),
        table_from_msg(response.table),
        tuple(response.phrase_none),
        response.backend,
        response.latency_s,
        tuple(response.vanished_tracks),
        tuple(response.moved_tracks),
    )


def points_from_msgs(points: list[Point]) -> FloatArray:
    """Read image points (N, 2) [px]."""
    return np.array([[p.x, p.y] for p in points]).reshape(-1, 2)
