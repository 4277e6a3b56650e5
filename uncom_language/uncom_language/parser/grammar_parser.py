# SPDX-License-Identifier: Apache-2.0
"""Sentences to commands with the grammar of a language pack."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

import lark
from uncom_common.primitive import Primitive

from uncom_language.parser.dialogue_acts import DialogueActReader
from uncom_language.parser.discourse import Utterance, commands_from_clauses
from uncom_language.parser.lexical.lexicon import Lexicon, load_lexicon
from uncom_language.parser.lexical.tagger import (
    Tagger,
    remove_false_starts,
    remove_fillers,
    remove_repetitions,
    split_text,
)
from uncom_language.parser.lexical.tokens import RawToken, Token
from uncom_language.parser.options import PARSER, TYPED_TEXT
from uncom_language.parser.syntax.clause import Clause
from uncom_language.parser.syntax.clause_reader import ClauseReader
from uncom_language.parser.syntax.grammar import NotInGrammarError, Tree, children, load_grammar, parse_tokens
from uncom_language.parser.syntax.locative_phrases import WordTiming
from uncom_language.parser.syntax.self_repair import apply_self_repairs
from uncom_language.parser.syntax.support_surfaces import resolve_support_part
from uncom_language.types import Act, Command, Relation, Span, Transcript, Word

BACKEND = "grammar"
# Classes of words with which a sentence that breaks off may end.
_UNFINISHED_TAGS = frozenset(
    {"DETERMINER", "RELATION", "TO", "SOURCE", "BETWEEN", "AND", "DISTANCE", "ADJECTIVE", "OTHER"}
)
_UNFINISHED_PLACE_TAGS = frozenset({"RELATION", "TO", "BETWEEN"})


@cache
def load_parser(language: str = "en") -> GrammarParser:
    """Return the (shared) parser of a language."""
    return GrammarParser(language)


class GrammarParser:
    """Deterministic parser from words to commands; the default language back end."""

    def __init__(self, language: str = "en") -> None:
        """Load the language pack and compile its grammar.

        Raises:
            UnknownLanguageError: there is no such pack.
        """
        self.lexicon: Lexicon = load_lexicon(language)
        self._tagger = Tagger(self.lexicon)
        self._acts = DialogueActReader(self.lexicon, self._parses)
        load_grammar(language)

    @property
    def backend(self) -> str:
        """Name of this back end and its language."""
        return f"{BACKEND} ({self.lexicon.language})"

    def parse(self, text: str, spans: Sequence[Span], utterance_id: str = "") -> tuple[Command, ...]:
        """Return the commands of one utterance, at least one.

        Args:
            text: the words; letter case and punctuation are free.
            spans: start and end [s] of every word of `text`, in order.
            utterance_id: repeated in every command.
        """
        items = split_text(text)
        opening = self._acts.read(items)
        said = Utterance(utterance_id, " ".join(text.split()), opening.amends)
        found: list[Command] = []
        refusal = self._acts.refusal(items) if opening.act is None else ""
        if refusal:
            found = [_refusal(said, f"{said.text!r}: {refusal}")]
        elif opening.rest:
            found = self._clauses(said, opening.rest, WordTiming(tuple(spans)), answered=opening.act is not None)
        amended = any(command.act is Act.CORRECTION for command in found)
        if opening.act in (Act.YES, Act.NO) and found and found[-1].act is Act.REFUSED:
            # "No, that is not what I meant" is a no; "yes, but ..." is no consent to be relied on.
            found = [] if opening.act is Act.NO else found
            amended = opening.act is Act.YES
        if opening.act is not None and not amended:
            found = [Command(said.id, opening.act, said.text), *found]
        if not found:
            found = [_refusal(said, "I heard no words that tell me what to do")]
        return tuple(
            replace(command, index=index, count=len(found), backend=self.backend) for index, command in enumerate(found)
        )

    def _parses(self, items: tuple[RawToken, ...]) -> bool:
        try:
            self._tree(items)
        except NotInGrammarError:
            return False
        return True

    def _tree(self, items: tuple[RawToken, ...]) -> Tree:
        """Parse words; where they make no sentence, they are tried without what is said twice or unfinished in vain.

        Raises:
            NotInGrammarError: they are no sentence.
        """
        try:
            return self._tree_of(items)
        except NotInGrammarError:
            once = remove_repetitions(items)
            once = remove_false_starts(once, self._tagger.tag(remove_fillers(once, self.lexicon)))
            if len(once) == len(items):
                raise
            return self._tree_of(once)

    def _tree_of(self, items: tuple[RawToken, ...]) -> Tree:
        """Parse words; where the likeliest classes make no sentence, others are tried.

        Raises:
            NotInGrammarError: they are no sentence.
        """
        kept = remove_fillers(items, self.lexicon)
        tokens = self._tagger.tag(kept)
        if not tokens:
            raise NotInGrammarError(None, ())
        try:
            return parse_tokens(tokens, self.lexicon.language)
        except NotInGrammarError as error:
            for number, (token, tag) in enumerate(self._alternative_tags(kept, tokens, error)):
                if number == PARSER.max_retagged:
                    break
                try:
                    return parse_tokens(self._tagger.tag(kept, {token.first: tag}), self.lexicon.language)
                except NotInGrammarError:
                    continue
            raise

    def _alternative_tags(
        self, items: Sequence[RawToken], tokens: list[Token], error: NotInGrammarError
    ) -> Iterator[tuple[Token, str]]:
        """Yield other classes for the word that does not fit and for the two before it."""
        misfit = next((i for i, token in enumerate(tokens) if token is error.token), len(tokens) - 1)
        for position in range(misfit, max(-1, misfit - PARSER.retagged_window), -1):
            if tokens[position].text != ".":
                for tag in self._tagger.other_tags(items, tokens[position]):
                    yield tokens[position], tag

    def _clauses(
        self, said: Utterance, items: tuple[RawToken, ...], timing: WordTiming, *, answered: bool
    ) -> list[Command]:
        refusal = self._acts.refusal(items)
        if refusal:
            return [_refusal(said, f"{said.text!r}: {refusal}")]
        repaired = apply_self_repairs(items, self.lexicon, self._tagger)
        try:
            clauses = self._read(repaired.items, timing)
        except NotInGrammarError as error:
            clauses = self._read_unfinished(repaired.items, timing)
            if not clauses:
                return [_refusal(said, _grammar_refusal(error, said.text))]
        reason = self._refusal_reason(clauses)
        if reason:
            return [_refusal(said, reason)]
        commands = [resolve_support_part(command, self.lexicon) for command in commands_from_clauses(said, clauses)]
        if all(command.act is Act.FRAGMENT and _is_bare_pronoun(command) for command in commands):
            return [_refusal(said, f"{said.text!r} is no command for me")]
        if (
            all(command.act is Act.INCOMPLETE and not _names_object_or_action(command) for command in commands)
            and not answered
        ):
            return [_refusal(said, f"{said.text!r} is no command for me")]
        return [replace(command, notes=(*command.notes, *repaired.notes)) for command in commands]

    def _read(self, items: tuple[RawToken, ...], timing: WordTiming) -> list[Clause]:
        tree = self._tree(items)
        reader = ClauseReader(self.lexicon, timing)
        return [reader.read(child) for child in children(tree) if isinstance(child, lark.Tree)]

    def _refusal_reason(self, clauses: list[Clause]) -> str:
        """Return why what was understood is not to be done; empty if it is."""
        ordered = next((clause.order for clause in clauses if clause.order), "")
        if ordered:
            return f"{ordered!r} is nothing that I could bring from this table"
        thrown = next((clause.action_text for clause in clauses if self._is_discarding(clause)), "")
        if thrown:
            return f"{thrown!r} is nothing that I do; tell me where to put it, into a bin for example"
        return ""

    def _is_discarding(self, clause: Clause) -> bool:
        """Whether an object is to be got rid of, and nobody says where to."""
        said = f"{clause.action_text} "
        thrown = any(said.startswith(f"{verb} ") for verb in self.lexicon.raw.get("thrown", ()))
        return thrown and bool(clause.objects) and clause.target is None and not clause.placed

    def _read_unfinished(self, items: tuple[RawToken, ...], timing: WordTiming) -> list[Clause]:
        """Read a sentence that ends within a phrase ("put the cup on the"); nothing if it is none."""
        kept = remove_fillers(items, self.lexicon)
        unfinished: list[Token] = []
        tokens = self._tagger.tag(kept)
        while tokens and tokens[-1].tag in _UNFINISHED_TAGS:
            unfinished.append(tokens.pop())
        if not unfinished or not any(token.tag == "VERB" for token in tokens):
            return []
        try:
            clauses = self._read(tuple(item for item in kept if item.index <= tokens[-1].last), timing)
        except NotInGrammarError:
            return []
        place = next((token for token in unfinished if token.tag in _UNFINISHED_PLACE_TAGS), None)
        if place is not None:
            relation = Relation(place.value) if place.tag == "RELATION" else Relation.NONE
            clauses[-1] = replace(clauses[-1], unfinished_part="target", relation=relation, target=None)
        return clauses


def _refusal(said: Utterance, reason: str) -> Command:
    return Command(said.id, Act.REFUSED, said.text, reason=reason)


def _grammar_refusal(error: NotInGrammarError, text: str) -> str:
    if error.token is None:
        return f"the sentence {text!r} ends too early to be a command"
    if error.token.first == 0 or error.token.tag == "UNKNOWN":
        return f"{text!r} is no command for me: I cannot use the word {error.token.text!r}"
    return f"I do not understand {text!r}: {error.token.text!r} does not fit there"


def _is_bare_pronoun(command: Command) -> bool:
    """Whether a fragment is nothing but "it"."""
    reference = command.object
    return reference is not None and reference.anaphoric and reference.quantity == 1 and command.target is None


def _names_object_or_action(command: Command) -> bool:
    return command.object is not None or command.primitive is not Primitive.NONE


def even_spans(count: int) -> tuple[Span, ...]:
    """Return made-up times for words that were typed, so that everything that follows is the same as for speech."""
    step_s = TYPED_TEXT.word_s
    return tuple(Span(step_s * i, step_s * (i + TYPED_TEXT.voiced_share)) for i in range(count))


def parse_text(text: str, language: str = "en") -> tuple[Command, ...]:
    """Parse typed text; word times are made up from the words' positions."""
    count = sum(not item.is_break for item in split_text(text))
    return load_parser(language).parse(text, even_spans(count))


def typed_transcript(text: str, language: str = "en") -> Transcript:
    """Return typed text as if it had been heard, with made-up word times."""
    pieces = text.split()
    spans = even_spans(len(pieces))
    words = tuple(Word(piece, span.start_s, span.end_s) for piece, span in zip(pieces, spans, strict=True))
    return Transcript("", words, language=language, backend="typed")


def parse_transcript(transcript: Transcript, language: str | None = None) -> tuple[Command, ...]:
    """Parse what was heard; every part keeps the times of its words."""
    pieces: list[Span] = []
    for word in transcript.words:
        # One recognised word may be several of ours ("left-hand"): they share its time.
        parts = sum(not item.is_break for item in split_text(word.text))
        pieces.extend([Span(word.start_s, word.end_s)] * parts)
    return load_parser(language or transcript.language).parse(transcript.text, pieces, transcript.utterance_id)
