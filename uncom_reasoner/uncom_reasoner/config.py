# SPDX-License-Identifier: Apache-2.0
"""What can be set: the parameters of the reasoner node, and among them those of grounding itself.

How long a pointing counts that comes late is `late_pointing_s`: hands are waited for so long after the last word (see
evidence/gesture_timing.py); within that time it loses weight as the weights `early_s` and `late_s` say
(config/weights.yaml, pointing/ray_fusion.py).
"""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.exceptions import InvalidConfigError
from uncom_common.parameters import check_parameters, parameter

PERSPECTIVES = ("robot", "speaker")
POSITIVE = (
    "buffer_s",
    "buffer_hz",
    "hands_keep_s",
    "wait_timeout_s",
    "detect_timeout_s",
    "question_timeout_s",
    "approval_timeout_s",
)  # parameters of the reasoner node that must be greater than zero


@dataclass(frozen=True)
class PlacingConfig:
    """How places are chosen."""

    base_frame: str = parameter("base_footprint", "frame of grounded commands")
    perspective: str = parameter("robot", "whose left and right: robot or speaker", choices=PERSPECTIVES)
    perspective_prior: float = parameter(
        0.9, "how likely that is meant, 0 to 1; near 0.5: asks where sides differ", minimum=0.0, maximum=1.0
    )
    clearance_m: float = parameter(0.02, "gap kept to other things [m]")
    edge_margin_m: float = parameter(0.02, "gap kept to the table's edge [m]")
    cell_m: float = parameter(0.06, "size of Voronoi cells [m]", minimum=0.02, maximum=0.3)
    reach_max_m: float = parameter(0.85, "farthest place from a shoulder, level [m]")
    reach_min_m: float = parameter(0.25, "nearest place to a shoulder, level [m]", minimum=0.0)

    def __post_init__(self) -> None:
        """Refuse unusable values.

        Raises:
            InvalidConfigError: one is; the text names the usable ones.
        """
        check_parameters(self)
        if not self.reach_min_m < self.reach_max_m:
            raise InvalidConfigError("reach_max_m", self.reach_max_m, "must be greater than reach_min_m")

    def prior_of(self, side: str) -> float:
        """Return how likely left and right are meant from a side (of PERSPECTIVES)."""
        return self.perspective_prior if side == self.perspective else 1.0 - self.perspective_prior


@dataclass(frozen=True)
class ReasonerConfig(PlacingConfig):
    """Parameters of reasoner_node."""

    weights_file: str = parameter("", "YAML of the posterior's weights; empty: shipped")
    reliable_images: bool = parameter(default=True, description="reliable image subscriptions; else best effort")
    use_depth: bool = parameter(default=True, description="use depth_registered images when they come")
    buffer_s: float = parameter(10.0, "how long images are kept [s]")
    buffer_hz: float = parameter(8.0, "most images kept a second [1/s]")
    hands_keep_s: float = parameter(20.0, "how long hands are kept [s]")
    late_pointing_s: float = parameter(0.6, "wait for hands after the last word [s]")
    wait_timeout_s: float = parameter(2.0, "longest wait for hands and images [s]")
    behind_s: float = parameter(0.3, "hands known up to so long before the last word: time to look [s]")
    detect_timeout_s: float = parameter(15.0, "longest wait for the detector, wall time [s]")
    hand_free_before_s: float = parameter(0.4, "no hand this long before a scene frame [s]")
    hand_free_after_s: float = parameter(0.8, "no hand this long after a scene frame [s]")
    look_ahead: bool = parameter(
        default=False, description="detect things while the person still speaks, to answer sooner"
    )
    question_timeout_s: float = parameter(15.0, "how long a question stays open [s]")
    approval_timeout_s: float = parameter(60.0, "how long a question whether to move stays open here [s]")

    def __post_init__(self) -> None:
        """Refuse unusable values.

        Raises:
            InvalidConfigError: one is; the text names the usable ones.
        """
        super().__post_init__()
        for name in POSITIVE:
            if getattr(self, name) <= 0.0:
                raise InvalidConfigError(name, getattr(self, name), "must be positive")
