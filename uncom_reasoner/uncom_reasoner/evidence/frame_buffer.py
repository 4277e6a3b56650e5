# SPDX-License-Identifier: Apache-2.0
"""Stamped items of the last seconds, and the choice of the frame in which objects are looked for."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from uncom_reasoner.evidence.options import SENSOR_MEMORY, SensorMemoryOptions

ItemT = TypeVar("ItemT")


class StampedBuffer(Generic[ItemT]):
    """The latest items with their stamps [s], in order, thinned to a rate. Thread safe.

    A jump back in time (`SensorMemoryOptions.clock_jump_s`: a bag starts again) empties it.
    """

    def __init__(self, keep_s: float, most_hz: float = 0.0, options: SensorMemoryOptions = SENSOR_MEMORY) -> None:
        """Start empty.

        Args:
            keep_s: age at which items are dropped, counted from the newest one [s].
            most_hz: the first item in each of so many slots a second is kept [1/s]; 0: all are.
            options: what counts as a jump of the clock.
        """
        self._keep_s = keep_s
        self._most_hz = most_hz
        self._clock_jump_s = options.clock_jump_s
        self._items: deque[tuple[float, ItemT]] = deque()
        self._lock = threading.Lock()

    def add(self, stamp_s: float, item: ItemT) -> None:
        """Add an item with its stamp [s]; one that is not newer than the last is dropped."""
        with self._lock:
            if self._items and stamp_s < self._items[-1][0] - self._clock_jump_s:
                self._items.clear()
            if self._items:
                last_s = self._items[-1][0]
                if stamp_s <= last_s or (self._most_hz > 0.0 and self._slot(stamp_s) == self._slot(last_s)):
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
    """The frame in which objects are looked for: its stamp [s], and whether hands in it may hide some of them."""

    stamp_s: float
    with_hand: bool


def choose_scene_frame(
    frames_s: Sequence[float], hands: Sequence[tuple[float, bool]], wanted_s: float, before_s: float, after_s: float
) -> SceneFrame | None:
    """Choose the frame in which objects are looked for; None without frames.

    Objects do not move while a person speaks, so that a frame without a hand shows them best: the last one before the
    object is spoken of (else the first one after) with no hand seen from before_s before to after_s after it; a hand
    that comes in is at the image's edge for a while before it is found. Without such a frame, the nearest one.

    Args:
        frames_s: stamps of the frames.
        hands: stamps of the frames in which hands were looked for, and whether there were any.
        wanted_s: when the object was spoken of [s].
        before_s: time without a hand before a frame [s].
        after_s: time without a hand after a frame [s].
    """
    if not frames_s:
        return None
    hands_s = [stamp_s for stamp_s, any_hand in hands if any_hand]
    hand_free_s = [t for t in frames_s if not any(t - before_s <= stamp_s <= t + after_s for stamp_s in hands_s)]
    if hand_free_s:
        # Before the hand rather than after it: afterwards the robot or the person may be about to act.
        earlier_s = [t for t in hand_free_s if t <= wanted_s]
        return SceneFrame(max(earlier_s) if earlier_s else min(hand_free_s), with_hand=False)
    return SceneFrame(min(frames_s, key=lambda t: abs(t - wanted_s)), with_hand=True)
