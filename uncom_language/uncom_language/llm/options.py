# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the language model."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ChatOptions:
    """How a language model is asked."""

    max_new_tokens: int = tunable(256, meaning="tokens after which an answer is cut")
    max_retries: int = tunable(1, meaning="times that it is told what is wrong with its answer")
    max_part_characters: int = tunable(80, meaning="characters of an object, action or target")
    max_time_s: float = tunable(100000, unit="s", meaning="latest time stamp in an answer")
    time_digits: int = tunable(2, meaning="decimals of the time stamps that it is given")


CHAT = ChatOptions()
