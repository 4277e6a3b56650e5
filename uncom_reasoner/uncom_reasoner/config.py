# SPDX-License-Identifier: Apache-2.0
"""What can be set: the parameters of the reasoner node, and those of grounding itself."""

from __future__ import annotations

from dataclasses import dataclass, field

from uncom_common.exceptions import InvalidConfigError

PERSPECTIVES = ("robot", "speaker")


@dataclass(frozen=True, slots=True)
class PlacingConfig:
    """How places are chosen [m]."""

    clearance_m: float = 0.02
    edge_margin_m: float = 0.02
    cell_m: float = 0.06
    reach_max_m: float = 0.85
    reach_min_m: float = 0.25
    shoulder_y_m: float = 0.19
    base_frame: str = "base_footprint"
    perspective: str = "robot"
    perspective_prior: float = 0.9

    def __post_init__(self) -> None:
        """Reject unusable values."""
        if self.perspective not in PERSPECTIVES:
            raise InvalidConfigError("perspective", self.perspective, f"choose {' or '.join(PERSPECTIVES)}")
        if not 0.0 <= self.perspective_prior <= 1.0:
            raise InvalidConfigError("perspective_prior", self.perspective_prior, "use a probability from 0 to 1")
        if not 0.02 <= self.cell_m <= 0.3:
            raise InvalidConfigError("cell_m", self.cell_m, "use a size between 0.02 and 0.3 m")
        if not 0.0 <= self.reach_min_m < self.reach_max_m:
            raise InvalidConfigError("reach_max_m", self.reach_max_m, "must be greater than reach_min_m")

    def prior_of(self, side: str) -> float:
        """Return how likely left and right are meant from a side."""
        return self.perspective_prior if side == self.perspective else 1.0 - self.perspective_prior


@dataclass(frozen=True)
class ReasonerConfig:
    """Parameters of reasoner_node."""

    base_frame: str = field(default="base_footprint", metadata={"description": "frame of grounded commands"})
    weights_file: str = field(default="", metadata={"description": "YAML of the posterior's weights; empty: shipped"})
    perspective: str = field(default="robot", metadata={"description": "whose left and right: robot or speaker"})
    perspective_prior: float = field(
        default=0.9, metadata={"description": "how likely that is meant, 0 to 1; near 0.5: asks where sides differ"}
    )
    reliable_images: bool = field(
        default=True, metadata={"description": "reliable image subscriptions; else best effort"}
    )
    use_depth: bool = field(default=True, metadata={"description": "use depth_registered images when they come"})
    buffer_s: float = field(default=10.0, metadata={"description": "how long images are kept [s]"})
    buffer_hz: float = field(default=8.0, metadata={"description": "most images kept a second [1/s]"})
    hands_keep_s: float = field(default=20.0, metadata={"description": "how long hands are kept [s]"})
    late_pointing_s: float = field(default=0.6, metadata={"description": "wait for hands after the last word [s]"})
    wait_timeout_s: float = field(default=2.0, metadata={"description": "longest wait for hands and images [s]"})
    behind_s: float = field(
        default=0.3, metadata={"description": "hands known up to so long before the last word: time to look [s]"}
    )
    detect_timeout_s: float = field(
        default=15.0, metadata={"description": "longest wait for the detector, wall time [s]"}
    )
    hand_free_before_s: float = field(
        default=0.4, metadata={"description": "no hand this long before a scene frame [s]"}
    )
    hand_free_after_s: float = field(default=0.8, metadata={"description": "no hand this long after a scene frame [s]"})
    look_ahead: bool = field(
        default=False, metadata={"description": "detect things while the person still speaks, to answer sooner"}
    )
    question_timeout_s: float = field(default=15.0, metadata={"description": "how long a question stays open [s]"})
    approval_timeout_s: float = field(
        default=60.0, metadata={"description": "how long a question whether to move stays open here [s]"}
    )
    clearance_m: float = field(default=0.02, metadata={"description": "gap kept to other things [m]"})
    edge_margin_m: float = field(default=0.02, metadata={"description": "gap kept to the table's edge [m]"})
    cell_m: float = field(default=0.06, metadata={"description": "size of Voronoi cells [m]"})
    reach_max_m: float = field(default=0.85, metadata={"description": "farthest place from a shoulder, level [m]"})
    reach_min_m: float = field(default=0.25, metadata={"description": "nearest place to a shoulder, level [m]"})

    def __post_init__(self) -> None:
        """Reject unusable values."""
        for name in ("buffer_s", "buffer_hz", "hands_keep_s", "wait_timeout_s", "detect_timeout_s",
                     "question_timeout_s", "approval_timeout_s"):  # fmt: skip
            if getattr(self, name) <= 0.0:
                raise InvalidConfigError(name, getattr(self, name), "must be positive")
        self.placing()

    def placing(self) -> PlacingConfig:
        """Return the part that placing needs."""
        return PlacingConfig(
            clearance_m=self.clearance_m,
            edge_margin_m=self.edge_margin_m,
            cell_m=self.cell_m,
            reach_max_m=self.reach_max_m,
            reach_min_m=self.reach_min_m,
            base_frame=self.base_frame,
            perspective=self.perspective,
            perspective_prior=self.perspective_prior,
        )
