# SPDX-License-Identifier: Apache-2.0
"""From one image to a scene: detected, named by its frame, followed over images, and matched to outside poses.

The detection node and the chain of the benchmark both call this.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.tracking.external_models import with_models
from uncom_perception.objects.tracking.object_tracker import ObjectTracker
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import HandsFrame, ObjectModel, Scene

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class OutsidePoses:
    """What an outside pose estimator answered for one image: models whose poses are in the named frame."""

    stamp_s: float
    frame_id: str
    models: tuple[ObjectModel, ...]


def nearest_poses(poses: Sequence[OutsidePoses], stamp_s: float, age_s: float) -> OutsidePoses | None:
    """Return the outside poses nearest to a time, or None if none is within age_s [s] of it."""
    near = [one for one in poses if abs(one.stamp_s - stamp_s) <= age_s]
    return min(near, key=lambda one: abs(one.stamp_s - stamp_s), default=None)


class SceneDetector:
    """A detector with the memory that follows objects from image to image."""

    def __init__(
        self,
        detector: ObjectDetector,
        same_name: Callable[[str, str], bool],
        *,
        track: bool,
        warn: Callable[[str], object] = logger.warning,
    ) -> None:
        """Start with nothing to follow.

        Args:
            detector: finds the objects of one image.
            same_name: whether two words mean the same kind of object, for the match with outside poses.
            track: whether objects are followed over images; only where the camera's pose is known.
            warn: is told why outside poses are left out.
        """
        self._detector, self._same_name, self._warn = detector, same_name, warn
        self._tracker = ObjectTracker() if track else None

    @property
    def name(self) -> str:
        """Back end and weights of the detector."""
        return self._detector.name

    def forget(self) -> None:
        """Follow nothing that was seen before."""
        if self._tracker is not None:
            self._tracker = ObjectTracker()

    def detect(
        self,
        frame: RgbdFrame,
        phrases: Sequence[str],
        hands: HandsFrame | None,
        outside: OutsidePoses | None = None,
    ) -> Scene:
        """Return what is seen, in the base frame where the camera's pose is given, else in the camera's frame.

        Args:
            frame: image that is searched.
            phrases: noun phrases, one query each.
            hands: hands seen in the same image.
            outside: poses of about the image's time; in another frame than the image's two they are left out.
        """
        scene = self._detector.detect(frame, phrases, hands)
        if self._tracker is not None and frame.camera_in_base is not None:
            scene = self._tracker.update(scene, frame)
        return scene if outside is None else self._with_outside(scene, outside, frame)

    def _with_outside(self, scene: Scene, outside: OutsidePoses, frame: RgbdFrame) -> Scene:
        camera_frame, camera_in_base = frame.camera_frame, frame.camera_in_base
        models = outside.models
        if outside.frame_id == camera_frame != scene.frame_id and camera_in_base is not None:
            models = tuple(replace(model, pose=camera_in_base @ model.pose) for model in models)
        elif outside.frame_id != scene.frame_id:
            frames = f"{outside.frame_id} is neither {scene.frame_id} nor {camera_frame}"
            self._warn(f"object poses are left out: their frame {frames}")
            return scene
        eye = np.zeros(3) if camera_in_base is None else camera_in_base[:3, 3]
        return with_models(scene, models, self._same_name, eye)
