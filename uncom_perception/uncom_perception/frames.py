# SPDX-License-Identifier: Apache-2.0
"""Images that wait for their depth and for their turn."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict, deque
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class WaitingImage:
    """An image message and the (monotonic) time it came in."""

    key: int
    image: Any
    arrived_s: float


class FrameQueue:
    """Pairs images with depth by stamp, keeps their order, never grows. Thread safe.

    An image is handed out when its depth is there, or when it has waited long enough; if more wait than there is room
    for, the oldest is dropped, so that a slow machine sees the newest.
    """

    def __init__(self, size: int, depth_wait_s: float) -> None:
        """Let at most size images wait, each at most depth_wait_s for its depth (0: not at all)."""
        self._size = size
        self._wait_s = depth_wait_s
        self._images: deque[WaitingImage] = deque()
        self._depths: OrderedDict[int, Any] = OrderedDict()
        self._changed = threading.Condition()
        self._closed = False
        self.dropped = 0

    def add_image(self, key: int, image: Any) -> None:
        """Take in an image; the key is its stamp."""
        with self._changed:
            self._images.append(WaitingImage(key, image, time.monotonic()))
            while len(self._images) > self._size:
                self._images.popleft()
                self.dropped += 1
            self._changed.notify()

    def add_depth(self, key: int, depth: Any) -> None:
        """Take in a depth image."""
        with self._changed:
            self._depths[key] = depth
            while len(self._depths) > 2 * self._size:
                self._depths.popitem(last=False)
            self._changed.notify()

    def close(self) -> None:
        """Let go of who waits."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def take(self) -> tuple[Any, Any | None] | None:
        """Return the next image and its depth (or None), waiting for it; None when closed."""
        with self._changed:
            while not self._closed:
                timeout = None
                if self._images:
                    first = self._images[0]
                    waited = time.monotonic() - first.arrived_s
                    if first.key in self._depths or waited >= self._wait_s:
                        self._images.popleft()
                        return first.image, self._depths.get(first.key)
                    timeout = self._wait_s - waited
                self._changed.wait(timeout)
        return None


@dataclass(frozen=True, slots=True)
class RawFrame:
    """One picture as it came over the wire, with its depth or None; it is decoded only when somebody asks for it."""

    stamp_s: float
    image: bytes
    depth: bytes | None


class RawBuffer:
    """Keeps serialized pictures of the last seconds, to be asked for by stamp. Thread safe."""

    def __init__(self, keep_s: float) -> None:
        """Keep pictures for keep_s."""
        self._keep_s = keep_s
        self._images: OrderedDict[int, bytes] = OrderedDict()
        self._depths: OrderedDict[int, bytes] = OrderedDict()
        self._lock = threading.Lock()

    def add_image(self, message: bytes) -> None:
        """Take in a serialized image."""
        self._add(self._images, message)

    def add_depth(self, message: bytes) -> None:
        """Take in a serialized depth image."""
        self._add(self._depths, message)

    def _add(self, kept: OrderedDict[int, bytes], message: bytes) -> None:
        key = read_stamp_ns(message)
        with self._lock:
            if kept and key < next(reversed(kept)) - 1_000_000_000:
                kept.clear()  # time was set back
            kept[key] = message
            while key - next(iter(kept)) > self._keep_s * 1e9:
                kept.popitem(last=False)

    def nearest(self, stamp_s: float) -> RawFrame | None:
        """Return the picture nearest to a time [s], one with depth if there are any; None if there is no picture."""
        with self._lock:
            keys = [key for key in self._images if key in self._depths] or list(self._images)
            if not keys:
                return None
            key = min(keys, key=lambda k: abs(k * 1e-9 - stamp_s))
            return RawFrame(key * 1e-9, self._images[key], self._depths.get(key))


def read_stamp_ns(message: bytes) -> int:
    """Read the stamp [ns] of a serialized message (CDR) that begins with a header."""
    order: Literal["little", "big"] = "little" if message[1] & 1 else "big"
    seconds = int.from_bytes(message[4:8], order, signed=True)
    return seconds * 1_000_000_000 + int.from_bytes(message[8:12], order)
