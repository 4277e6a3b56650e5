# SPDX-License-Identifier: Apache-2.0
"""A labelled image with the pixels of every label at hand, so that none is looked for in the whole image again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.foreground import LabelImage

Pixels = npt.NDArray[np.int64]
Box = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Regions:
    """Labels (H, W), 0 for none, and the flat indices of the labelled pixels by label.

    Those of label i are pixels[starts[i]:starts[i + 1]].
    """

    labels: LabelImage
    pixels: Pixels
    starts: Pixels

    @property
    def count(self) -> int:
        """The highest label."""
        return len(self.starts) - 2

    @property
    def sizes(self) -> Pixels:
        """Numbers of pixels (L + 1,) by label."""
        return np.diff(self.starts)

    def of(self, label: int) -> Pixels:
        """Return the flat indices of a label's pixels."""
        return self.pixels[self.starts[label] : self.starts[label + 1]]

    def ids(self) -> npt.NDArray[np.int32]:
        """Return the label of each of the pixels."""
        return np.repeat(np.arange(self.count + 1, dtype=np.int32), self.sizes)

    def boxes(self) -> dict[int, Box]:
        """Return rows and columns that each label covers."""
        used = np.flatnonzero(self.sizes)
        if len(used) == 0:
            return {}
        firsts = self.starts[used]
        sides = [
            extreme.reduceat(values, firsts).tolist()
            for values in np.divmod(self.pixels.astype(np.int32), self.labels.shape[1])
            for extreme in (np.minimum, np.maximum)
        ]
        return {
            label: (slice(t, b + 1), slice(lo, hi + 1))
            for label, t, b, lo, hi in zip(used.tolist(), *sides, strict=True)
        }

    def renumbered(self, numbers: npt.NDArray[np.integer]) -> Regions:
        """Return the same pixels with other labels, by the old ones (L + 1,); 0 takes them out."""
        ids = np.asarray(numbers, np.int32)[self.ids()]
        labels = np.zeros(self.labels.shape, np.int32)
        labels.ravel()[self.pixels] = ids
        kept = np.flatnonzero(ids)
        return _sorted(labels, self.pixels[kept], ids[kept])


def regions_of(labels: LabelImage, least: int = 1) -> Regions:
    """Sort the pixels of a labelled image (H, W) by label; those with fewer than the least are taken out."""
    flat = labels.ravel()
    used = np.flatnonzero(flat)
    ids = flat[used]
    sizes = np.bincount(ids)
    if len(ids) == 0 or sizes[sizes > 0].min() >= least:
        return _sorted(labels, used, ids)
    keep = sizes >= least
    ids = np.where(keep, np.cumsum(keep), 0).astype(np.int32)[ids]
    kept = np.flatnonzero(ids)
    cleaned = np.zeros(labels.shape, np.int32)
    cleaned.ravel()[used] = ids
    return _sorted(cleaned, used[kept], ids[kept])


def _sorted(labels: LabelImage, pixels: Pixels, ids: npt.NDArray[np.int32]) -> Regions:
    order = np.argsort(ids.astype(np.uint16), kind="stable")  # in one pass, as the numbers are short
    starts = np.concatenate([[0], np.cumsum(np.bincount(ids))]) if len(ids) else np.zeros(2, np.int64)
    return Regions(labels, pixels[order], starts)
