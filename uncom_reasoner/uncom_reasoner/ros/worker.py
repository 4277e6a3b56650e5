# SPDX-License-Identifier: Apache-2.0
"""One thread that carries out calls in the order in which they were handed over."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

logger = logging.getLogger(__name__)


class Worker:
    """A queue with one thread; a call that raises does not keep the next from being carried out."""

    def __init__(self, log_error: Callable[[str], object] = logger.error) -> None:
        """Start idle; log_error is told of calls that raised."""
        self._log_error = log_error
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="deciding")
        self._lock = threading.Lock()
        self._pending = 0

    @property
    def busy(self) -> bool:
        """Whether a call that was handed over has not ended."""
        with self._lock:
            return self._pending > 0

    def run(self, work: Callable[..., object], *args: object) -> None:
        """Hand a call over; after `close` it is dropped."""
        with self._lock:
            self._pending += 1
        try:
            self._pool.submit(self._safely, work, *args)
        except RuntimeError:  # closed
            self._done()

    def _safely(self, work: Callable[..., object], *args: object) -> None:
        try:
            work(*args)
        except Exception as error:  # noqa: BLE001 (see the class)
            self._log_error(f"{getattr(work, '__name__', work)} failed: {error!r}")
        finally:
            self._done()

    def _done(self) -> None:
        with self._lock:
            self._pending -= 1

    def close(self) -> None:
        """Let the call in progress end, and drop the rest."""
        self._pool.shutdown(wait=True, cancel_futures=True)
