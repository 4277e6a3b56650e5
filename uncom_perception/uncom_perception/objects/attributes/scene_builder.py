# SPDX-License-Identifier: Apache-2.0
"""From found objects to the answer: labels, attributes, phrase probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.attributes.options import ATTRIBUTES, AttributeOptions
from uncom_perception.objects.attributes.phrase_matcher import DescribedObject, PhraseMatcher
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import Attribute, Box, Detection, Geometry, Mask, Scene, TableSurface

_METRIC = {"length": "length_m", "width": "width_m", "height": "height_m"}


def answer(
    matcher: PhraseMatcher,
    seen: Sequence[tuple[Mask, Geometry | None]],
    objects: Sequence[DescribedObject],
    table: TableSurface | None,
    phrases: Sequence[str],
    *,
    frame: RgbdFrame,
    backend: str,
    trust: float = 1.0,
) -> Scene:
    """Put the answer about an image together; trust (0 to 1) lowers all scores of a back end that sees less."""
    scores: list[npt.NDArray[np.float64]] = []
    none: list[float] = []
    for phrase in phrases:
        if is_table(phrase):
            probability, rest = np.zeros(len(objects)), 1.0
        else:
            probability, rest = matcher.match(phrase, objects)
        scores.append(probability * trust)
        none.append(1.0 - trust * (1.0 - rest))
    detections = []
    for i, ((mask, body), candidate) in enumerate(zip(seen, objects, strict=True)):
        label, score = matcher.label(candidate)
        detections.append(
            Detection(
                id=f"thing_{i + 1}",
                label=label,
                score=trust * score,
                box=mask_box(mask),
                mask=mask,
                geometry=body,
                attributes=_attributes(candidate),
                phrase_scores=tuple(float(s[i]) for s in scores),
            )
        )
    return Scene(frame.stamp_s, frame.frame_id, tuple(detections), table, tuple(none), backend)


def is_table(phrase: str) -> bool:
    """Whether a phrase means the table itself."""
    words = phrase.lower().replace(".", " ").split()
    return (
        bool(words)
        and words[-1] in ("table", "tabletop", "desk", "worktop")
        and len(words) <= ATTRIBUTES.longest_table_phrase
    )


def mask_box(mask: Mask) -> Box:
    """Return the box about a mask (H, W)."""
    x, y, width, height = cv2.boundingRect(np.ascontiguousarray(mask).view(np.uint8))
    return Box(float(x), float(y), float(x + width), float(y + height))


def mask_slices(mask: Mask, rows: slice = slice(0, None), columns: slice = slice(0, None)) -> tuple[slice, slice]:
    """Return rows and columns of the box about a mask that lies within some of them, one pixel wider."""
    x, y, width, height = cv2.boundingRect(np.ascontiguousarray(mask[rows, columns]).view(np.uint8))
    x, y = x + columns.start, y + rows.start
    return slice(max(0, y - 1), y + height + 1), slice(max(0, x - 1), x + width + 1)


def colour_attributes(shares: Mapping[str, float], *, options: AttributeOptions = ATTRIBUTES) -> tuple[Attribute, ...]:
    """Return the colours that cover enough of an object, from the share of its pixels that each name covers."""
    return tuple(
        Attribute("colour", name, share) for name, share in shares.items() if share >= options.least_colour_share
    )


def _attributes(candidate: DescribedObject) -> tuple[Attribute, ...]:
    found = list(colour_attributes(candidate.colours))
    if candidate.shape is not None:
        s = candidate.shape
        found += [Attribute(_METRIC.get(name, name), f"{value:.3f}", 1.0) for name, value in s.items().items()]
        found.append(Attribute("hollow", "yes", float(np.clip((s.hollowness - 0.05) / 0.25, 0.0, 1.0))))
    return tuple(found)
