# SPDX-License-Identifier: Apache-2.0
"""The same objects over several images: their names stay, and what moved or went away is noticed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from uncom_common.transforms import apply, invert

from uncom_perception.objects.tracking.options import TRACKER, TrackerOptions
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import Detection, Scene


@dataclass(frozen=True, slots=True)
class _Track:
    name: str
    detection: Detection
    colours: Mapping[str, float]


class ObjectTracker:
    """Follows objects by place and looks in a frame that stays where it is (the base frame)."""

    def __init__(self, *, options: TrackerOptions = TRACKER) -> None:
        """Know nothing yet."""
        self._options = options
        self._tracks: dict[str, _Track] = {}
        self._stamp_s = -np.inf
        self._count = 0

    def update(self, scene: Scene, frame: RgbdFrame) -> Scene:
        """Return the scene with the names of tracks, and the tracks that moved or vanished since the last image.

        An object that is not seen has vanished only if the camera sees past it; else a hand or another object may hide
        it, and it keeps its name until it is seen again. An older image than the last one is named and changes nothing.
        """
        if scene.stamp_s < self._stamp_s - 30.0:  # time was set back
            self._tracks.clear()
            self._stamp_s = -np.inf
        past = scene.stamp_s < self._stamp_s
        names, moved = self._match(scene.detections)
        detections = []
        for index, detection in enumerate(scene.detections):
            name = names.get(index)
            if name is None and not past:
                self._count += 1
                name = f"track_{self._count}"
            detections.append(replace(detection, track=name or ""))
        gone = []
        if not past:
            self._stamp_s = scene.stamp_s
            seen = {d.track for d in detections}
            gone = [
                name
                for name, track in self._tracks.items()
                if name not in seen and _sees_past(track.detection, frame, options=self._options)
            ]
            for name in gone:
                del self._tracks[name]
            for d in detections:
                self._tracks[d.track] = _Track(d.track, d, _colours(d))
        return replace(
            scene, detections=tuple(detections), vanished_tracks=tuple(gone), moved_tracks=() if past else tuple(moved)
        )

    def _match(self, detections: tuple[Detection, ...]) -> tuple[dict[int, str], list[str]]:
        """Return the track of each detection that has one, and the tracks that are elsewhere."""
        tracks = list(self._tracks.values())
        if not tracks or not detections:
            return {}, []
        distance = np.array([[_distance(t.detection, d, options=self._options) for t in tracks] for d in detections])
        reach = np.array([[max(self._options.near_m, 0.5 * _size(t.detection)) for t in tracks] for _ in detections])
        likeness = np.array([[_likeness(t, d) for t in tracks] for d in detections])
        names: dict[int, str] = {}
        moved = []
        cost = np.where(distance < reach, distance / reach - 0.5 * likeness, 10.0)
        for i, j in zip(*linear_sum_assignment(cost), strict=True):
            if cost[i, j] < self._options.greatest_cost:
                names[int(i)] = tracks[j].name
                if distance[i, j] > self._options.moved_m:
                    moved.append(tracks[j].name)
        # What is nowhere near its place may have been carried elsewhere: the look decides.
        free_d = [i for i in range(len(detections)) if i not in names]
        free_t = [j for j, t in enumerate(tracks) if t.name not in names.values()]
        if free_d and free_t:
            unlike = 1.0 - likeness[np.ix_(free_d, free_t)]
            for i, j in zip(*linear_sum_assignment(unlike), strict=True):
                if unlike[i, j] < 1.0 - self._options.alike:
                    names[free_d[i]] = tracks[free_t[j]].name
                    moved.append(tracks[free_t[j]].name)
        return names, moved


def _size(detection: Detection) -> float:
    if detection.geometry is not None:
        return float(np.max(detection.geometry.size[:2]))
    return 0.0


def _distance(a: Detection, b: Detection, *, options: TrackerOptions = TRACKER) -> float:
    """Return how far apart two detections are [m]; in the image, in units that make half a box's width the reach."""
    if a.geometry is not None and b.geometry is not None:
        return float(np.linalg.norm(a.geometry.centroid - b.geometry.centroid))
    width = max(a.box.x_max - a.box.x_min, a.box.y_max - a.box.y_min, 1.0)
    return 2.0 * options.near_m * float(np.hypot(*(np.array(a.box.center) - np.array(b.box.center)))) / width


def _colours(detection: Detection) -> dict[str, float]:
    return {a.value: a.probability for a in detection.attributes if a.name == "colour"}


def _likeness(track: _Track, detection: Detection) -> float:
    """Return how alike two looks at objects are, 0 to 1: colours and sizes."""
    mine, theirs = track.colours, _colours(detection)
    total = max(sum(mine.values()), sum(theirs.values()), 1e-6)
    colour = sum(min(mine[name], theirs[name]) for name in mine.keys() & theirs.keys()) / total
    a, b = track.detection.geometry, detection.geometry
    if a is None or b is None:
        return float(colour)
    ratio = np.maximum(np.sort(a.size), 0.005) / np.maximum(np.sort(b.size), 0.005)
    shape = float(np.exp(-np.abs(np.log(ratio)).mean() / 0.25))
    return float(colour * shape)


def _sees_past(
    detection: Detection,
    frame: RgbdFrame,
    *,
    options: TrackerOptions = TRACKER,
) -> bool:
    """Whether the camera sees what is behind the place where an object was."""
    body = detection.geometry
    if body is None:
        return True  # the picture alone does not tell what hides an object
    depth, camera, camera_in_base = frame.depth, frame.camera, frame.camera_in_base
    if depth is None or camera is None:
        return False
    cloud = body.cloud[:: max(1, len(body.cloud) // options.sample)]
    points = cloud if camera_in_base is None else apply(invert(camera_in_base), cloud)
    pixels = camera.project(points)
    known = np.isfinite(pixels[:, 0])
    u, v = np.round(np.where(known[:, None], pixels, -1.0)).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    if inside.sum() < 0.5 * len(points):
        return False  # out of sight
    seen = depth[v[inside], u[inside]]
    with np.errstate(invalid="ignore"):
        past = seen > points[inside, 2] + options.behind_m
    return float(past.sum()) > options.gone_share * max(int(np.isfinite(seen).sum()), 1)
