# SPDX-License-Identifier: Apache-2.0
"""Pictures of a missed take: what was decided on its two frames, and what was meant."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from uncom_bringup.bags.image_codec import encode_jpeg
from uncom_bringup.chain.chain import Grounding
from uncom_bringup.chain.recording import CameraFrame
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import TransformBuffer, apply, invert
from uncom_reasoner.explanation.annotated_image import annotate
from uncom_reasoner.types import View

from uncom_sim.bench_understanding.reporting.options import REPORTS, ReportOptions
from uncom_sim.bench_understanding.takes.recording import TakeRecording
from uncom_sim.bench_understanding.takes.types import TakePlan

Picture = npt.NDArray[np.uint8]
FloatArray = npt.NDArray[np.float64]


def draw_miss(
    folder: Path, plan: TakePlan, recording: TakeRecording, first: Grounding | None, *, options: ReportOptions = REPORTS
) -> tuple[str, ...]:
    """Write the pictures of a miss; returns the file's name."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{plan.name}.jpg"
    frames = list(recording.frames())
    pose = camera_pose(recording)
    looked = first.evidence.view if first is not None and first.evidence is not None else None
    if first is None or looked is None:
        picture = np.hstack([frame.rgb for frame in _pointing_frames(recording, frames)])
    else:
        grounded = first.decision.grounded
        pair = [_nearest(frames, stamp).rgb.copy() for stamp in (grounded.object_frame_s, grounded.target_frame_s)]
        for one, role in zip(pair, ("object", "target"), strict=True):
            _mark_meant(one, plan, recording, role, recording.camera, pose, options=options)
        picture = annotate(pair[0], pair[1], first.decision, View(looked.camera, looked.transform_camera_to_scene))
    (folder / name).write_bytes(encode_jpeg(np.asarray(picture, np.uint8), 85))
    return (name,)


def camera_pose(recording: TakeRecording) -> FloatArray:
    """Return the pose (4, 4) of the camera's optical frame in base_footprint."""
    buffer = TransformBuffer()
    for transform, static in recording.transforms:
        buffer.add(transform, static=static)
    return buffer.lookup(recording.camera_frame, "base_footprint", recording.stored[0].stamp_s)


def _mark_meant(
    picture: Picture,
    plan: TakePlan,
    recording: TakeRecording,
    role: str,
    camera: PinholeCamera,
    pose: FloatArray,
    *,
    options: ReportOptions = REPORTS,
) -> None:
    """Draw a blue cross on what is meant."""
    name = getattr(plan.meaning, role)
    if name is not None:
        place = next(s.position for s in recording.truth.states if s.id == name)
    elif plan.meaning.area is not None:
        place = np.array([*plan.meaning.area, plan.scene.table.height])
    else:
        return
    u, v = camera.project(apply(invert(pose), place[None]))[0]
    cv2.drawMarker(picture, (round(float(u)), round(float(v))), options.meant_colour, cv2.MARKER_CROSS, 22, 2)


def _pointing_frames(recording: TakeRecording, frames: Sequence[CameraFrame]) -> list[CameraFrame]:
    """Return the frames at the ends of the times of pointing, or the first and the last one."""
    stamps = [p.end_s for p in recording.truth.pointing] or [frames[0].stamp_s, frames[-1].stamp_s]
    return [_nearest(frames, stamp) for stamp in stamps]


def _nearest(frames: Sequence[CameraFrame], stamp_s: float) -> CameraFrame:
    return min(frames, key=lambda frame: abs(frame.stamp_s - stamp_s))
