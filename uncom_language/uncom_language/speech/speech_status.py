# SPDX-License-Identifier: Apache-2.0
"""What the recogniser is doing."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class SpeechState(IntEnum):
    """The constants of SpeechStatus.msg."""

    IDLE = 0
    SPEECH = 1
    RECOGNISING = 2


@dataclass(frozen=True, slots=True)
class SpeechStatus:
    """All sound up to `examined_until_s` [s] was examined; `rejected` stretches of it gave no transcript."""

    examined_until_s: float
    state: SpeechState
    rejected: int = 0
    last_rejection: str = ""
