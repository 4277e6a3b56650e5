# SPDX-License-Identifier: Apache-2.0
"""From what was seen and what the detector answered to the evidence of a decision."""

from __future__ import annotations

import numpy as np
from uncom_language.types import Command
from uncom_perception.types import Scene

from uncom_reasoner.evidence.frame_buffer import SceneFrame
from uncom_reasoner.evidence.gesture_timing import object_end_s, target_end_s
from uncom_reasoner.evidence.sensor_memory import SensorMemory
from uncom_reasoner.types import Evidence, Given, View


def build_evidence(
    command: Command,
    scene: Scene,
    frame: SceneFrame,
    phrases: tuple[str, ...],
    given: Given,
    memory: SensorMemory,
    hands_until_s: float,
) -> Evidence:
    """Gather what a command is decided on.

    Args:
        command: with the times of its words.
        scene: what the detector found in the frame; its frame is the memory's base frame, or the camera's where the
            camera's pose was not known.
        frame: of the image that the scene was found in.
        phrases: that the scene's scores are for.
        given: what is settled already.
        memory: of images, hands and transforms.
        hands_until_s: later hands are left out [s].
    """
    in_base = scene.frame_id == memory.base_frame
    transform = memory.camera_in_base(frame.stamp_s) if in_base else np.eye(4)
    hand = "a hand is in it" if frame.with_hand else "no hand was seen around it"
    return Evidence(
        command=command,
        scene=scene,
        phrases=phrases,
        view=View(memory.camera, transform),
        rays=memory.rays(command, None if in_base else transform, hands_until_s),
        object_frame_s=memory.nearest_image_s(object_end_s(command)),
        target_frame_s=memory.nearest_image_s(target_end_s(command)),
        given=given,
        notes=(f"the things are those of the image of {frame.stamp_s:.2f} s: {hand}",),
    )
