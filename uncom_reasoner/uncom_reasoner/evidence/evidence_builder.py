# SPDX-License-Identifier: Apache-2.0
"""From what was seen and what the detector answered to the evidence of a decision."""

from __future__ import annotations

import numpy as np

from uncom_reasoner.evidence.grounding_job import Job, object_end, target_end
from uncom_reasoner.evidence.sensor_memory import Senses
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.types import Evidence, View


def evidence_of(job: Job, senses: Senses, base_frame: str) -> Evidence:
    """Gather what a command is decided on, once its scene is there.

    Raises:
        InvalidGroundingError: nothing was looked at.
    """
    command, scene = job.command, job.scene
    if scene is None:
        raise InvalidGroundingError("a command is decided on before anything was seen")
    in_base = scene.frame_id == base_frame
    transform = senses.camera_in_base(job.scene_s) if in_base else np.eye(4)
    hand = "a hand is in it" if job.with_hand else "no hand was seen around it"
    return Evidence(
        command=command,
        scene=scene,
        phrases=job.phrases,
        view=View(senses.camera, transform),
        rays=senses.rays(command, None if in_base else transform, job.until_s),
        object_frame_s=senses.nearest_image_s(object_end(command)),
        target_frame_s=senses.nearest_image_s(target_end(command)),
        given=job.given,
        notes=(f"the things are those of the image of {job.scene_s:.2f} s: {hand}",),
    )
