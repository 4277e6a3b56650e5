# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune segmentation."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ClusterSegmenterOptions:
    """How a mask is grown around a point or a box."""

    guess: float = tunable(0.16, meaning="of the image's width: the box that GrabCut starts from about a bare point")
    depth_jump: float = tunable(0.012, meaning="of the depth: more between neighbouring pixels is an edge")


CLUSTER_SEGMENTER = ClusterSegmenterOptions()
