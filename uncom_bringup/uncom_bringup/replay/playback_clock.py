# SPDX-License-Identifier: Apache-2.0
"""The pace of a replay: when each message is due, at a rate that may change, with pauses and single steps.

Without ROS: what is sent is whatever it is given.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from uncom_bringup.replay.keyboard import DOWN, RIGHT, SPACE, UP
from uncom_bringup.replay.options import PLAYBACK, PlaybackOptions

AnyT = TypeVar("AnyT")
ItemT = TypeVar("ItemT", bound="Timed")


class Timed(Protocol):
    """Anything that is due at a time."""

    @property
    def time_ns(self) -> int:
        """When, on the bag's clock [ns]."""


@dataclass(frozen=True, slots=True)
class Played:
    """What became of a replay: how many messages, and how late half of them and 95 % of them were at most [s]."""

    count: int
    median_late_s: float
    late_s: float
    ended: bool  # False if the user had enough


def prefetch(items: Iterable[AnyT], most: int = PLAYBACK.prefetched) -> Iterator[AnyT]:
    """Yield items that another thread has made some way (at most `most`) ahead; its errors are raised here."""
    ready: queue.Queue[tuple[AnyT | None, BaseException | None]] = queue.Queue(most)
    stopped = threading.Event()

    def put(item: AnyT | None, error: BaseException | None) -> None:
        while not stopped.is_set():
            try:
                ready.put((item, error), timeout=0.2)
            except queue.Full:
                continue
            return

    def fill() -> None:
        try:
            for item in items:
                put(item, None)
                if stopped.is_set():
                    return
        except Exception as error:  # noqa: BLE001  (handed on)
            put(None, error)
        else:
            put(None, None)

    thread = threading.Thread(target=fill, name="read ahead", daemon=True)
    thread.start()
    try:
        while True:
            item, error = ready.get()
            if error is not None:
                raise error
            if item is None:
                return
            yield item
    finally:
        stopped.set()
        thread.join(timeout=5.0)


class Playback(Generic[ItemT]):
    """Sends items when they are due."""

    def __init__(
        self,
        send: Callable[[ItemT], None],
        tell_time: Callable[[int], None],
        key: Callable[[], str | None] = lambda: None,
        show: Callable[[int, str], None] = lambda _ns, _state: None,
        options: PlaybackOptions = PLAYBACK,
        now_s: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Nothing is sent yet.

        Args:
            send: publishes one item.
            tell_time: gets the bag's time [ns] often, for /clock.
            key: returns the newest key, or None.
            show: gets the bag's time [ns] and the state in words, for a progress bar.
            options: numbers of the pace.
            now_s: returns the wall's time [s] from any start; it never goes back.
            sleep: waits for so many seconds of that time.
        """
        self._options = options
        self._wall_s, self._sleep = now_s, sleep
        self._send, self._tell_time, self._key, self._show = send, tell_time, key, show
        self.rate = 1.0
        self.paused = False
        self._steps = 0
        self._done = False
        self._base_ns, self._base_s = 0, 0.0
        self._told_s = float("-inf")

    def play(self, items: Iterable[ItemT], start_ns: int, rate: float) -> Played:
        """Send all items, the first due after start_ns [ns, the bag's clock]; `rate` is of the wall's clock."""
        self.rate, self._done = rate, False
        self._base_ns, self._base_s = start_ns, self._wall_s()
        late: list[float] = []
        count, last_ns = 0, start_ns
        for item in items:
            if not self._wait(item.time_ns):
                break
            self._tell(item.time_ns)
            if not self.paused:
                late.append(1e-9 * (self._now_ns() - item.time_ns) / self.rate)
            self._send(item)
            count += 1
            last_ns = item.time_ns
            if self.paused:
                self._base_ns = item.time_ns
        if count:
            self._tell_time(last_ns)
        late.sort()

        def quantile(share: float) -> float:
            return late[max(0, math.ceil(share * len(late)) - 1)] if late else 0.0

        return Played(count, quantile(0.5), quantile(0.95), not self._done)

    def _now_ns(self) -> int:
        if self.paused:
            return self._base_ns
        return self._base_ns + int(1e9 * self.rate * (self._wall_s() - self._base_s))

    def _wait(self, due_ns: int) -> bool:
        """Wait until something is due, or one step is asked for; False to stop."""
        while True:
            self._keys()
            now_ns = self._now_ns()
            if self._done:
                return False
            if self.paused:
                if self._steps > 0:
                    self._steps -= 1
                    return True
                self._show(now_ns, "paused")
                self._sleep(self._options.tick_s)
                continue
            ahead_s = 1e-9 * (due_ns - now_ns) / self.rate
            if ahead_s <= 0.0:
                return True
            # In simulated time the clock goes on between messages, too.
            self._tell(now_ns)
            self._show(now_ns, f"rate {self.rate:.2g}")
            if ahead_s > self._options.wake_up_delay_s:
                self._sleep(min(ahead_s - self._options.wake_up_delay_s, self._options.tick_s))

    def _tell(self, now_ns: int) -> None:
        """Tell the time, unless that was done a moment ago."""
        wall_s = self._wall_s()
        if self.paused or wall_s - self._told_s >= self._options.clock_period_s:
            self._told_s = wall_s
            self._tell_time(now_ns)

    def _keys(self) -> None:
        key = self._key()
        if key == SPACE:
            self._rebase()
            self.paused = not self.paused
        elif key in (RIGHT, "s"):
            if not self.paused:
                self._rebase()
                self.paused = True
            self._steps += 1
        elif key in (UP, DOWN):
            self._rebase()
            self.rate *= self._options.rate_factor if key == UP else 1.0 / self._options.rate_factor
        elif key == "q":
            self._done = True

    def _rebase(self) -> None:
        """Let the clock go on from where it is, whatever changes now."""
        self._base_ns, self._base_s = self._now_ns(), self._wall_s()
