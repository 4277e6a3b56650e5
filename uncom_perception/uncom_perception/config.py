# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes: each field is one, its default is typed here and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass, field

from uncom_common.exceptions import InvalidConfigError


@dataclass(frozen=True)
class GestureConfig:
    """Parameters of gesture_node."""

    backend: str = field(default="mediapipe", metadata={"description": "hand detector: mediapipe"})
    styles: tuple[str, ...] = field(
        default=("index", "two_fingers"), metadata={"description": "pointing styles: index, two_fingers, hand"}
    )
    min_detection_confidence: float = field(default=0.3, metadata={"description": "of the palm detector, 0 to 1"})
    min_evidence: float = field(default=0.4, metadata={"description": "how sure pointing has to be, 0 to 1"})
    keep_s: float = field(default=0.7, metadata={"description": "after a hand was seen, look again for so long [s]"})
    bridge_s: float = field(
        default=0.25, metadata={"description": "bridge so long a loss of the pointing hand, 0 for none [s]"}
    )
    attention_s: float = field(
        default=1.0, metadata={"description": "expect a pointing hand so long after speech was heard [s]"}
    )
    queue_size: int = field(default=3, metadata={"description": "images that may wait; the oldest is dropped"})
    depth_wait_s: float = field(default=0.15, metadata={"description": "wait so long for an image's depth [s]"})
    use_depth: bool = field(default=True, metadata={"description": "make rays metric by registered depth"})
    reliable_images: bool = field(default=True, metadata={"description": "reliable instead of best-effort images"})

    def __post_init__(self) -> None:
        """Reject values that cannot work."""
        for name in ("min_detection_confidence", "min_evidence"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise InvalidConfigError(name, getattr(self, name), "must lie between 0 and 1")
        if self.queue_size < 1:
            raise InvalidConfigError("queue_size", self.queue_size, "must be at least 1")


@dataclass(frozen=True)
class DetectionConfig:
    """Parameters of detection_node."""

    backend: str = field(default="tabletop", metadata={"description": "object detector: tabletop, grounding_dino"})
    segmentation: str = field(default="cluster", metadata={"description": "segmentation: cluster, sam"})
    depth_backend: str = field(default="none", metadata={"description": "depth of plain images: none, dpt"})
    lexicon: str = field(default="", metadata={"description": "YAML file with more words for things"})
    detection_model: str = field(default="", metadata={"description": "weights of grounding_dino, empty for the tiny"})
    segmentation_model: str = field(default="", metadata={"description": "weights of sam, empty for vit-base"})
    depth_model: str = field(default="", metadata={"description": "weights of dpt, empty for dinov2-small-nyu"})
    device: str = field(default="auto", metadata={"description": "where models with weights run: auto, cpu, cuda"})
    box_threshold: float = field(default=0.3, metadata={"description": "grounding_dino: least score of a box"})
    text_threshold: float = field(default=0.25, metadata={"description": "grounding_dino: least score of a word"})
    detection_batch: int = field(
        default=4, metadata={"description": "grounding_dino: phrases of one request that are looked for at once"}
    )
    sam_boxes: bool = field(default=False, metadata={"description": "prompt sam by boxes, not by centre points"})
    camera_above_table_m: float = field(
        default=0.0, metadata={"description": "scale estimated depth to this height of the camera, 0 for not [m]"}
    )
    track_objects: bool = field(default=True, metadata={"description": "follow things over images"})
    buffer_s: float = field(default=3.0, metadata={"description": "keep images for requests by stamp, 0 for none [s]"})
    model_age_s: float = field(
        default=0.5, metadata={"description": "poses from outside count so long before and after [s]"}
    )
    reliable_images: bool = field(default=True, metadata={"description": "reliable instead of best-effort images"})

    def __post_init__(self) -> None:
        """Reject values that cannot work."""
        if self.detection_batch < 1:
            raise InvalidConfigError("detection_batch", self.detection_batch, "must be at least 1")
