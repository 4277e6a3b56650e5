# SPDX-License-Identifier: Apache-2.0
"""A labelled image with the pixels of every label at hand, so that none is looked for in the whole image again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments import LabelImage

Pixels = npt.NDArray[np.int64]
Box = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Regions:
    """Labels (H, W), 0 for none, and the flat indices of the labelled pixels by label, in the image's order.

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
        row, column = np.divmod(self.pixels, self.labels.shape[1])
        firsts = self.starts[used]
        left, right = np.minimum.reduceat(column, firsts), np.maximum.reduceat(column, firsts)
        top, bottom = row[firsts], row[self.starts[used + 1] - 1]
        sides = (top, bottom, left, right)
        return {
            label: (slice(t, b + 1), slice(lo, hi + 1))
            for label, t, b, lo, hi in zip(used.tolist(), *(s.tolist() for s in sides), strict=True)
        }

    def renumbered(self, numbers: npt.NDArray[np.integer]) -> Regions:
        """Return the same pixels with other labels, by the old ones (L + 1,); 0 takes them out."""
        labels = np.zeros(self.labels.shape, np.int32)
        labels.ravel()[self.pixels] = numbers[self.ids()]
        return regions_of(labels)


def regions_of(labels: LabelImage) -> Regions:
    """Sort the pixels of a labelled image (H, W) by label."""
    flat = labels.ravel()
    used = np.flatnonzero(flat)
    ids = flat[used]
    order = np.argsort(ids.astype(np.uint16), kind="stable")  # in one pass, as the numbers are short
    starts = np.concatenate([[0], np.cumsum(np.bincount(ids))]) if len(ids) else np.zeros(2, np.int64)
    return Regions(labels, used[order], starts)
