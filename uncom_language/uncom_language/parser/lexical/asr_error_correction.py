# SPDX-License-Identifier: Apache-2.0
"""Misheard nouns: replaced only on evidence ("ball" heard, a bowl on the table), and the command says so."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import jellyfish
from rapidfuzz.distance import DamerauLevenshtein, JaroWinkler

from uncom_language.parser.lexical.lexicon import Lexicon, load_lexicon
from uncom_language.parser.options import CORRECTION
from uncom_language.types import Act, Alternative, Command, Reference


@dataclass(frozen=True, slots=True)
class WordCorrection:
    """A word that was replaced, and why."""

    heard: str
    meant: str
    evidence: tuple[str, ...]

    @property
    def note(self) -> str:
        """One line for the report."""
        return f"heard {self.heard!r}, taken as {self.meant!r}: {', '.join(self.evidence)}"


def word_similarity(first: str, second: str) -> float:
    """Return how alike two words sound and are written, 0 to 1."""
    sounds = jellyfish.metaphone(first), jellyfish.metaphone(second)
    sound = DamerauLevenshtein.normalized_similarity(*sounds) if all(sounds) else 0.0
    return CORRECTION.sound_share * float(sound) + (1.0 - CORRECTION.sound_share) * float(
        JaroWinkler.similarity(first, second)
    )


def find_correction(
    heard: str, seen: Iterable[str], alternatives: Sequence[Alternative] = (), lexicon: Lexicon | None = None
) -> WordCorrection | None:
    """Return what a noun was meant to be, None if it stands.

    A word stands if it is seen, or if nothing that is seen (or that the recogniser also heard) sounds like it. A word
    that the lexicon knows is replaced only by what is seen; an unknown one also by a known word of an alternative.

    Args:
        heard: the noun, singular.
        seen: nouns of what is there.
        alternatives: of the recogniser, for the utterance.
        lexicon: of the language; English by default.
    """
    lexicon = lexicon or load_lexicon()
    there = {word.lower() for word in seen}
    known = heard in lexicon.noun_class
    if heard in there:
        return None
    heard_too = {lexicon.singular.get(word.text, word.text) for other in alternatives for word in other.words}
    candidates = set(there) if known else there | (heard_too & set(lexicon.noun_class))
    ranked = sorted(((word_similarity(heard, word), word) for word in candidates - {heard}), reverse=True)
    if not ranked or ranked[0][0] < CORRECTION.min_similarity:
        return None
    best, meant = ranked[0]
    if len(ranked) > 1 and best - ranked[1][0] < CORRECTION.min_margin and ranked[1][1] not in heard_too:
        return None
    evidence = [f"they sound alike ({best:.2f})"]
    if meant in there:
        evidence.append(f"there is a {meant} and no {heard}")
    if meant in heard_too:
        evidence.append("the recogniser heard it as well")
    if not known:
        evidence.append(f"{heard!r} is no word I know")
    return WordCorrection(heard, meant, tuple(evidence))


def correct_nouns(
    command: Command,
    seen: Iterable[str],
    alternatives: Sequence[Alternative] = (),
    language: str = "en",
    *,
    closed_world: bool = True,
) -> Command:
    """Return the command with misheard nouns replaced; its notes and the references' `heard` tell.

    Args:
        command: as understood.
        seen: nouns of what is there.
        alternatives: of the transcript that it was taken from.
        language: language pack.
        closed_world: whether `seen` is all that is there, so that a word of the lexicon that is not seen may be wrong.
    """
    if command.act not in (Act.COMMAND, Act.FRAGMENT, Act.CORRECTION):
        return command
    corrector = _NounCorrector(tuple(seen), tuple(alternatives), load_lexicon(language), closed_world=closed_world)
    made = replace(
        command,
        object=corrector.correct(command.object),
        target=corrector.correct(command.target),
        reference2=corrector.correct(command.reference2),
    )
    return replace(
        made, notes=(*command.notes, *dict.fromkeys(correction.note for correction in corrector.corrections))
    )


class _NounCorrector:
    def __init__(
        self, seen: tuple[str, ...], alternatives: tuple[Alternative, ...], lexicon: Lexicon, *, closed_world: bool
    ) -> None:
        self._seen, self._alternatives, self._lexicon = seen, alternatives, lexicon
        self._closed_world = closed_world
        self.corrections: list[WordCorrection] = []

    def correct(self, reference: Reference | None) -> Reference | None:
        """Return a reference whose head, and those of what it hangs on, is what was meant."""
        if reference is None:
            return None
        made = replace(
            reference, anchor=self.correct(reference.anchor), compared_to=self.correct(reference.compared_to)
        )
        if not made.concrete or (made.head in self._lexicon.noun_class and not self._closed_world):
            return made
        correction = find_correction(made.head, self._seen, self._alternatives, self._lexicon)
        if correction is None:
            return made
        self.corrections.append(correction)
        words = made.text.split()
        last = max((i for i, word in enumerate(words) if self._singular(word) == made.head), default=len(words) - 1)
        words[last] = correction.meant
        return replace(made, head=correction.meant, text=" ".join(words), heard=correction.heard)

    def _singular(self, word: str) -> str:
        return self._lexicon.singular.get(word, word)
