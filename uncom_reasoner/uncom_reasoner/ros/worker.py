# SPDX-License-Identifier: Apache-2.0
"""One thread that does things in the order in which they were handed to it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

logger = logging.getLogger(__name__)


class Worker:
    """A queue with one thread; a fault of one thing does not keep the next from being done."""

    def __init__(self, complain: Callable[[str], object] = logger.error) -> None:
        """Start idle; `complain` is told of faults."""
        self._complain = complain
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="deciding")
        self._lock = threading.Lock()
        self._left = 0

    @property
    def busy(self) -> bool:
        """Whether something that was handed over is not done."""
        with self._lock:
            return self._left > 0

    def run(self, work: Callable[..., object], *args: object) -> None:
        """Hand something over; after `close` it is dropped."""
        with self._lock:
            self._left += 1
        try:
            self._pool.submit(self._safely, work, *args)
        except RuntimeError:  # closed
            self._done()

    def _safely(self, work: Callable[..., object], *args: object) -> None:
        try:
            work(*args)
        except Exception as error:  # noqa: BLE001 (see the class)
            self._complain(f"{getattr(work, '__name__', work)} failed: {error!r}")
        finally:
            self._done()

    def _done(self) -> None:
        with self._lock:
            self._left -= 1

    def close(self) -> None:
        """Let what is being done end, and drop the rest."""
        self._pool.shutdown(wait=True, cancel_futures=True)
