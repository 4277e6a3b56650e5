# SPDX-License-Identifier: Apache-2.0
"""How long a pointing hand is expected for what is heard: looks cost time, and are worth it while somebody speaks."""

from __future__ import annotations

from collections.abc import Iterable

DEICTIC_WORDS = frozenset(("this", "that", "these", "those", "here", "there"))


def expected_after_speech(start_s: float, attention_s: float) -> float:
    """Return until when [s] a hand is expected once somebody has begun to speak at start_s [s]."""
    return start_s + attention_s


def expected_after_words(words: Iterable[str], end_s: float, attention_s: float) -> float:
    """Return until when [s] a hand is expected after words that ended at end_s [s]; minus infinity: no longer."""
    pointing = any(word.lower() in DEICTIC_WORDS for word in words)
    return end_s + 2.0 * attention_s if pointing else float("-inf")
