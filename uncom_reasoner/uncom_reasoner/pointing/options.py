# SPDX-License-Identifier: Apache-2.0
"""Numbers of pointing: which rays belong together, how they are fused, and how well an object fits them.

The spreads that are fitted on takes are in config/weights.yaml (`Weights`).
"""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class RayTrackOptions:
    """Which rays are of one hand; widths are those of the image."""

    same_hand_widths: float = tunable(0.1, meaning="fingertips this near are of the same hand, whatever it is called")
    same_hand_s: float = tunable(0.5, unit="s", meaning="for so long after a ray its hand is looked for there")
    other_name_widths: float = tunable(0.05, meaning="a hand of the other name must be nearer by this")


@dataclass(frozen=True, slots=True)
class RayFusionOptions:
    """How rays become dwells, and dwells the gesture of a phrase; widths are those of the image."""

    min_hand_score: float = tunable(0.05, meaning="least score that a hand counts with")
    min_sigma_rad: float = tunable(0.01, unit="rad", meaning="least error of a ray's direction")
    other_hand_share: float = tunable(
        0.3, meaning="share that a hand counts which the gesture node does not call the pointing one"
    )
    split_gap_s: float = tunable(0.45, unit="s", meaning="a hand that was away for longer begins another dwell")
    split_angle_rad: float = tunable(0.45, unit="rad", meaning="a hand that has turned by more begins another dwell")
    split_tip_widths: float = tunable(0.06, meaning="a fingertip that has moved by more begins another dwell")
    split_frames: int = tunable(3, meaning="a frame is compared with so many frames before it")
    cut_tip_widths: float = tunable(
        0.03, meaning="means of two dwells joined by a slow hand differ by this much, or by cut_angle_rad"
    )
    cut_angle_rad: float = tunable(0.2, unit="rad", meaning="see cut_tip_widths; both count together")
    min_dwell_frames: int = tunable(2, meaning="frames of a dwell that is cut out of a longer one")
    min_weight_share: float = tunable(
        0.4, meaning="share of min_gesture_weight: less is a hand passing by, more may be a hand seen late"
    )
    independent_frames: float = tunable(
        4.0, meaning="errors of neighbouring frames are alike, so that more frames than these do not help"
    )
    metric_divisor: float = tunable(3.0, meaning="a dwell is metric if its frames' weight divided by this has depth")
    outlier_min_rad: float = tunable(0.15, unit="rad", meaning="directions this near to the middle one are kept")
    outlier_medians: float = tunable(2.5, meaning="directions within so many median errors are kept, too")
    min_share: float = tunable(0.05, meaning="dwells with a smaller share of a phrase's weight are left out")
    time_cutoff: float = tunable(
        3.0, meaning="standard deviations (early_s, late_s) from a phrase beyond which a moment does not count"
    )


@dataclass(frozen=True, slots=True)
class PointingLikelihoodOptions:
    """How well an object or place fits a gesture."""

    max_points: int = tunable(400, meaning="points of an object that are measured, at most")
    box_steps: int = tunable(9, meaning="points along each side of the box of an object without a mask")
    behind_z: float = tunable(30.0, meaning="largest error of what is behind the hand [standard deviations]")
    behind_width_ratio: float = tunable(
        0.02, meaning="in the image, what is behind counts one standard deviation for each of these [image widths]"
    )
    middle_share: float = tunable(0.15, meaning="share of the squared error that is that of the object's middle")
    middle_max_z: float = tunable(6.0, meaning="largest error of the middle that counts [standard deviations]")
    max_squared_z: float = tunable(200.0, meaning="largest squared error that counts")


@dataclass(frozen=True, slots=True)
class TablePointOptions:
    """Where a gesture meets the support: a fan of rays around it."""

    fan_sigmas: float = tunable(2.0, meaning="half width of the fan [standard deviations]")
    fan_steps: int = tunable(9, meaning="rays across the fan")
    outside_margin_m: float = tunable(0.04, unit="m", meaning="rays that miss the table by less still count")
    min_weight: float = tunable(0.02, meaning="least share of the fan that meets the table")
    max_length_m: float = tunable(1.2, unit="m", meaning="people point at places nearer than this to the fingertip")
    max_sight_m: float = tunable(10.0, unit="m", meaning="the same from the camera, where the finger has no depth")
    min_fingers: float = tunable(0.5, meaning="without depth: nearest place [finger lengths in the image]")
    max_fingers: float = tunable(12.0, meaning="without depth: farthest place [finger lengths in the image]")
    finger_steps: int = tunable(24, meaning="without depth: places along a ray")
    usual_fingers: float = tunable(3.0, meaning="without depth: usual distance [finger lengths in the image]")
    fingers_sigma: float = tunable(0.7, meaning="without depth: spread of its logarithm")


RAY_TRACK = RayTrackOptions()
RAY_FUSION = RayFusionOptions()
POINTING_LIKELIHOOD = PointingLikelihoodOptions()
TABLE_POINT = TablePointOptions()
