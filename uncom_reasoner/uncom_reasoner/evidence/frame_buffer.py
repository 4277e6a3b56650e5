# SPDX-License-Identifier: Apache-2.0
"""What was seen lately, bounded in time, and which of it a command needs."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

ItemT = TypeVar("ItemT")


class StampedBuffer(Generic[ItemT]):
    """The latest items with their stamps [s], in order, thinned to a rate. Thread safe.

    A jump back in time of more than a second (a bag starts again) empties it.
    """

    def __init__(self, keep_s: float, most_hz: float = 0.0) -> None:
        """Keep items for keep_s; with most_hz > 0, the first item in each of so many slots a second."""
        self._keep_s = keep_s
        self._most_hz = most_hz
        self._items: deque[tuple[float, ItemT]] = deque()
        self._lock = threading.Lock()

    def add(self, stamp_s: float, item: ItemT) -> None:
        """Take in an item; one that is older than the last is dropped."""
        with self._lock:
            if self._items and stamp_s < self._items[-1][0] - 1.0:
                self._items.clear()
            if self._items:
                last = self._items[-1][0]
                if stamp_s <= last or (self._most_hz > 0.0 and self._slot(stamp_s) == self._slot(last)):
                    return
            self._items.append((stamp_s, item))
            while self._items[-1][0] - self._items[0][0] > self._keep_s:
                self._items.popleft()

    def _slot(self, stamp_s: float) -> int:
        return int(stamp_s * self._most_hz + 1e-6)

    def items(self) -> list[tuple[float, ItemT]]:
        """Return all items with their stamps, oldest first."""
        with self._lock:
            return list(self._items)

    def latest_s(self) -> float:
        """Return the stamp of the newest item, or minus infinity."""
        with self._lock:
            return self._items[-1][0] if self._items else float("-inf")

    def nearest(self, stamp_s: float, tolerance_s: float = float("inf")) -> tuple[float, ItemT] | None:
        """Return the item nearest to a time, or None if none is within the tolerance."""
        found = min(self.items(), key=lambda entry: abs(entry[0] - stamp_s), default=None)
        return found if found is not None and abs(found[0] - stamp_s) <= tolerance_s else None


@dataclass(frozen=True, slots=True)
class SceneFrame:
    """The frame whose things are weighed; with_hand tells that hands may hide some of them."""

    stamp_s: float
    with_hand: bool


def scene_frame(
    frames_s: Sequence[float], hands: Sequence[tuple[float, bool]], wanted_s: float, before_s: float, after_s: float
) -> SceneFrame | None:
    """Choose the frame whose things are weighed.

    Things do not move while a person speaks, so that a frame without a hand shows them best: the last one before the
    object is spoken of (else the first one after) with no hand seen from before_s before to after_s after it; a hand
    that comes in is at the image's edge for a while before it is found. Without such a frame, the nearest one.

    Args:
        frames_s: stamps of the frames.
        hands: stamps of the frames in which hands were looked for, and whether there were any.
        wanted_s: when the object was spoken of.
        before_s: time without a hand before a frame.
        after_s: time without a hand after a frame.
    """
    if not frames_s:
        return None
    seen = [stamp for stamp, any_hand in hands if any_hand]
    free = [t for t in frames_s if not any(t - before_s <= stamp <= t + after_s for stamp in seen)]
    if free:
        # Before the hand rather than after it: afterwards the robot or the person may be about to act.
        earlier = [t for t in free if t <= wanted_s]
        return SceneFrame(max(earlier) if earlier else min(free), with_hand=False)
    return SceneFrame(min(frames_s, key=lambda t: abs(t - wanted_s)), with_hand=True)
