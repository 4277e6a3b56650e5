# SPDX-License-Identifier: Apache-2.0
"""A ROS domain id of one's own, so that two graphs on one machine never meet.

Ports as in the DDS-RTPS specification (section 9.6.2): a participant of domain d listens on 7410 + 250 d and above.
"""

from __future__ import annotations

import fcntl
import logging
import os
import random
import socket
import tempfile
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from uncom_bringup.exceptions import BadInputError, NoFreeDomainError
from uncom_bringup.graph.options import DOMAIN, DomainOptions

_LOG = logging.getLogger(__name__)

# Above 101 the ports reach into the range that Linux hands out by itself.
_FREE_DOMAINS = range(1, 102)
_HIGHEST = 232  # the ports of higher ones would lie above 65535


def _in_use(domain: int, options: DomainOptions) -> bool:
    """Tell whether one of the first participants of a domain holds its port."""
    for participant in range(options.probed_participants):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("0.0.0.0", 7410 + 250 * domain + 2 * participant))  # noqa: S104  (the port as DDS binds it)
            except OSError:
                return True
    return False


def domain_from_text(text: str) -> int:
    """Read a domain id as ROS_DOMAIN_ID gives it.

    Raises:
        BadInputError: it is not a number from 0 to 232.
    """
    if not text.strip().isdecimal() or int(text) > _HIGHEST:
        raise BadInputError(f"ROS_DOMAIN_ID is {text!r}; it must be a number from 0 to {_HIGHEST}")
    return int(text)


class DomainClaim:
    """Holds a domain id until closed: the one the user set, or a free one.

    Raises:
        NoFreeDomainError: no id is free.
        BadInputError: the wanted one is not an id.
    """

    def __init__(self, wanted: str | None = None, options: DomainOptions = DOMAIN) -> None:
        """Claim `wanted` (as ROS_DOMAIN_ID says it) as it is, or find a free id if it is None or empty."""
        self._options = options
        self._lock: int | None = None
        self.domain = domain_from_text(wanted) if wanted else self._find_free()

    def _find_free(self) -> int:
        candidates = list(_FREE_DOMAINS)
        random.Random(os.getpid()).shuffle(candidates)
        for domain in candidates:
            if not self._take_lock(domain):
                continue
            if not _in_use(domain, self._options):
                _LOG.info("ROS domain id %d", domain)
                return domain
            self.close()
        raise NoFreeDomainError("no ROS domain id from 1 to 101 is free; stop some graphs or set ROS_DOMAIN_ID")

    def _take_lock(self, domain: int) -> bool:
        """Lock a file for this domain: no other process takes it before our first node has bound its ports."""
        path = Path(tempfile.gettempdir()) / f"uncom-{os.getuid()}-domain-{domain}.lock"
        descriptor = os.open(path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            return False
        self._lock = descriptor
        return True

    def close(self) -> None:
        """Give the id back."""
        if self._lock is not None:
            with suppress(OSError):
                os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the id back."""
        self.close()
