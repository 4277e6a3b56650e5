# SPDX-License-Identifier: Apache-2.0
"""Word confidences and timed alternatives from an n-best list."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher

from uncom_language.types import Alternative, Word


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One entry of an n-best list with its log score."""

    words: tuple[str, ...]
    score: float


def _matching_indices(best: Sequence[str], other: Sequence[str]) -> set[int]:
    """Return the indices of the best words that another hypothesis shares, in order."""
    matcher = SequenceMatcher(None, best, other, autojunk=False)
    return {block.a + i for block in matcher.get_matching_blocks() for i in range(block.size)}


def add_confidences(words: tuple[Word, ...], hypotheses: Sequence[Hypothesis]) -> tuple[Word, ...]:
    """Give every word its posterior over the n-best list: the weight of the hypotheses that hold it."""
    texts = tuple(word.text for word in words)
    pool = {hypothesis.words: hypothesis.score for hypothesis in hypotheses}
    pool.setdefault(texts, max(pool.values(), default=0.0))
    top = max(pool.values())
    weights = {other: math.exp(score - top) for other, score in pool.items()}
    total = sum(weights.values())
    mass = [0.0] * len(words)
    for other, weight in weights.items():
        for index in _matching_indices(texts, other):
            mass[index] += weight
    return tuple(replace(word, confidence=min(1.0, weight / total)) for word, weight in zip(words, mass, strict=True))


def make_alternatives(words: tuple[Word, ...], hypotheses: Sequence[Hypothesis]) -> tuple[Alternative, ...]:
    """Return the other hypotheses, best first.

    Words shared with the best one keep their times, the others share the time of what they replace.
    """
    texts = tuple(word.text for word in words)
    best = next((hypothesis.score for hypothesis in hypotheses if hypothesis.words == texts), None)
    if best is None:
        best = max((hypothesis.score for hypothesis in hypotheses), default=0.0)
    return tuple(
        Alternative(_align_times(words, hypothesis.words), min(0.0, hypothesis.score - best))
        for hypothesis in hypotheses
        if hypothesis.words and hypothesis.words != texts
    )


def _align_times(words: tuple[Word, ...], other: tuple[str, ...]) -> tuple[Word, ...]:
    texts = tuple(word.text for word in words)
    timed: list[Word] = []
    for tag, i1, i2, j1, j2 in SequenceMatcher(None, texts, other, autojunk=False).get_opcodes():
        if tag == "equal":
            timed.extend(replace(word, confidence=word.confidence) for word in words[i1:i2])
            continue
        start = words[i1].start_s if i1 < i2 else (words[i1 - 1].end_s if i1 else words[0].start_s)
        end = words[i2 - 1].end_s if i1 < i2 else start
        step = (end - start) / max(1, j2 - j1)
        timed.extend(Word(text, start + step * n, start + step * (n + 1), 0.0) for n, text in enumerate(other[j1:j2]))
    return tuple(timed)
