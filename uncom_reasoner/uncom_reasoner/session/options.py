# SPDX-License-Identifier: Apache-2.0
"""Numbers of a session: how long it waits, and how much it remembers of what it proposed."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """Waits and bounds of a session. How long what is waited for: the parameters of the reasoner node."""

    steady_wait_factor: float = tunable(
        3.0, meaning="waits end after this multiple of their limit on the steady clock, should the stamps' clock stand"
    )
    remembered_proposals: int = tunable(20, meaning="sentences kept for the question whether a motion may begin")
    remembered_consents: int = tunable(50, meaning="ids kept of the consent questions that the session put itself")


SESSION = SessionOptions()
