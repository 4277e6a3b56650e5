# SPDX-License-Identifier: Apache-2.0
"""Sentences to commands: dialogue acts, several clauses, what is carried over from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import lark

from uncom_language.parser import repair
from uncom_language.parser.clauses import Clause, ClauseReader
from uncom_language.parser.grammar import NotInGrammarError, Tree, children, load_grammar, parse_tokens
from uncom_language.parser.lexicon import Lexicon, load_lexicon
from uncom_language.parser.references import Timing
from uncom_language.parser.tagger import Item, Tagger, split_text, without_fillers
from uncom_language.types import Act, Command, Primitive, Relation, Span, Transcript

BACKEND = "grammar"
_ACTS = {"stop": Act.STOP, "cancel": Act.CANCEL, "yes": Act.YES, "no": Act.NO}
_ASKS = {
    "action": "the action is missing: what shall I do with {part}?",
    "object": "the object is missing: what shall I {part}?",
    "target": "the target is missing: where shall I {part}?",
}
# Text without sound gets even times, so that everything that follows is the same for both.
_WORD_S = 0.4


@dataclass(frozen=True, slots=True)
class _Utterance:
    """What is the same for all commands of an utterance."""

    id: str
    text: str


@cache
def grammar_parser(language: str = "en") -> GrammarParser:
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
        said = _Utterance(utterance_id, " ".join(text.split()))
        items = split_text(text)
        acts, items = self._leading_act(items)
        found = [self._act(said, act) for act in acts]
        if items and not (found and found[-1].act in (Act.STOP, Act.CANCEL)):
            found.extend(self._clauses(said, items, Timing(tuple(spans)), answered=bool(found)))
        if not found:
            found = [self._refused(said, "I heard no words that tell me what to do")]
        return tuple(
            replace(command, index=index, count=len(found), backend=self.backend) for index, command in enumerate(found)
        )

    # --- dialogue acts ----------------------------------------------------------------------------

    def _leading_act(self, items: tuple[Item, ...]) -> tuple[list[Act], tuple[Item, ...]]:
        """Take a dialogue act off the front; all of the utterance may be one."""
        lexicon = self.lexicon
        words = tuple(item.text for item in items if not item.is_break)
        if words in lexicon.acts:
            return [_ACTS[lexicon.acts[words]]], ()
        if words in lexicon.social:
            return [], items
        bare = tuple(item.text for item in without_fillers(items, lexicon) if not item.is_break)
        acts, rest = self._only_acts(bare or words)
        if acts and not rest:
            return [_most_careful(acts)], ()
        if acts and acts[0] is Act.STOP and not self._parses(items):
            return [Act.STOP], ()
        if acts and acts[0] in (Act.YES, Act.NO):
            length = self._act_length(items)
            remainder = tuple(item for item in items[length:])
            while remainder and remainder[0].is_break:
                remainder = remainder[1:]
            if length and remainder and self._parses(remainder):
                return [acts[0]], remainder
        return [], items

    def _only_acts(self, words: tuple[str, ...]) -> tuple[list[Act], tuple[str, ...]]:
        acts: list[Act] = []
        while words:
            length = next((n for n in range(min(len(words), 5), 0, -1) if words[:n] in self.lexicon.acts), 0)
            if not length:
                break
            acts.append(_ACTS[self.lexicon.acts[words[:length]]])
            words = words[length:]
        return acts, words

    def _act_length(self, items: tuple[Item, ...]) -> int:
        words = tuple(item.text for item in items)
        return next((n for n in range(min(len(words), 5), 0, -1) if words[:n] in self.lexicon.acts), 0)

    def _parses(self, items: tuple[Item, ...]) -> bool:
        try:
            self._tree(items)
        except NotInGrammarError:
            return False
        return True

    # --- clauses ----------------------------------------------------------------------------------

    def _tree(self, items: tuple[Item, ...]) -> Tree:
        kept = without_fillers(items, self.lexicon)
        tokens = self._tagger.tag(kept)
        if not tokens:
            raise NotInGrammarError(None, ())
        return parse_tokens(tokens, self.lexicon.language)

    def _clauses(self, said: _Utterance, items: tuple[Item, ...], timing: Timing, *, answered: bool) -> list[Command]:
        words = tuple(item.text for item in items if not item.is_break)
        if words in self.lexicon.social:
            return [self._refused(said, f"{said.text!r} is no command for me")]
        if any(words[: len(negation)] == negation for negation in self.lexicon.negations):
            return [self._refused(said, "I was told not to do something; I do nothing")]
        reading = repair.best_reading(items, self.lexicon, self._tagger)
        try:
            tree = self._tree(reading.items)
            reader = ClauseReader(self.lexicon, timing)
            clauses = [reader.read(child) for child in children(tree) if isinstance(child, lark.Tree)]
        except NotInGrammarError as error:
            return [self._refused(said, _why_refused(error, said.text))]
        ordered = next((clause.order for clause in clauses if clause.order), "")
        if ordered:
            return [self._refused(said, f"{ordered!r} is nothing that I could bring from this table")]
        commands = _combine(said, clauses)
        if all(command.act is Act.INCOMPLETE and not _names_thing(command) for command in commands) and not answered:
            return [self._refused(said, f"{said.text!r} is no command for me")]
        return [replace(command, notes=(*command.notes, *reading.notes)) for command in commands]

    def _act(self, said: _Utterance, act: Act) -> Command:
        return Command(said.id, act, said.text)

    def _refused(self, said: _Utterance, reason: str) -> Command:
        return Command(said.id, Act.REFUSED, said.text, reason=reason)


def _most_careful(acts: list[Act]) -> Act:
    """Return the act that moves the robot least when several are said at once."""
    return next(act for act in (Act.STOP, Act.CANCEL, Act.NO, Act.YES) if act in acts)


def _why_refused(error: NotInGrammarError, text: str) -> str:
    if error.token is None:
        return f"the sentence {text!r} ends too early to be a command"
    if error.token.first == 0 or error.token.tag == "UNKNOWN":
        return f"{text!r} is no command for me: I cannot use the word {error.token.text!r}"
    return f"I do not understand {text!r}: {error.token.text!r} does not fit there"


def _names_thing(command: Command) -> bool:
    return command.object is not None or command.primitive is not Primitive.NONE


def _combine(said: _Utterance, clauses: Sequence[Clause]) -> list[Command]:
    """Join "take X" with "put it there", carry pronouns and verbs over, and split things that go together."""
    commands: list[Command] = []
    held: Clause | None = None
    previous: Clause | None = None
    for position, clause in enumerate(clauses):
        current = _with_verb_of(clause, previous)
        following = clauses[position + 1] if position + 1 < len(clauses) else None
        if current.kind == "take" and following is not None and _continues(following):
            held = _resolved(current, previous)
            previous = held
            continue
        current = _resolved(current, held or previous)
        commands.extend(_commands_of(said, current))
        previous, held = current, None
    return commands


def _continues(clause: Clause) -> bool:
    """Whether a clause ends what "take X" began: it moves "it" on, and does not pick it again."""
    if clause.kind in ("", "take", "point"):
        return clause.kind == "" and not clause.objects and clause.target is not None
    return all(thing.anaphoric for thing in clause.objects)


def _with_verb_of(clause: Clause, previous: Clause | None) -> Clause:
    """Fill a fragment ("... and the apple on the plate") with the verb before it."""
    if clause.kind or previous is None:
        return clause
    kind = "put" if previous.kind == "take" and clause.target is not None else previous.kind
    objects = clause.objects or previous.objects
    return replace(
        clause, kind=kind, action_text=previous.action_text, action_span=previous.action_span, objects=objects
    )


def _resolved(clause: Clause, before: Clause | None) -> Clause:
    """Replace "it" and "them" by what was spoken of before."""
    if before is None or not before.objects:
        return clause
    objects = clause.objects
    if not objects and clause.kind in ("put", "stack", "pour", "push", "give"):
        objects = tuple(replace(thing, anaphoric=True) for thing in before.objects)
    elif any(thing.anaphoric for thing in objects):
        objects = tuple(
            replace(old, anaphoric=True, order=thing.order) if thing.anaphoric else thing
            for thing in objects
            for old in (before.objects if thing.anaphoric else (thing,))
        )
    target = clause.target
    if target is not None and target.anaphoric:
        inside = clause.relation in (Relation.IN, Relation.ON)
        old_target = before.target if before.target is not None and before.target.concrete else None
        antecedent = old_target if inside and old_target is not None else before.objects[0]
        target = replace(antecedent, anaphoric=True, order=target.order)
    return replace(clause, objects=objects, target=target)


def _commands_of(said: _Utterance, clause: Clause) -> list[Command]:
    missing = clause.missing
    command = Command(
        utterance_id=said.id,
        act=Act.INCOMPLETE if missing else Act.COMMAND,
        text=said.text,
        action_text=clause.action_text,
        primitive=clause.primitive,
        action_span=clause.action_span,
        target=clause.target,
        reference2=clause.reference2,
        relation=clause.relation,
        reason=_ask(clause, missing),
    )
    if clause.kind == "stack" and clause.target is not None and command.relation is Relation.NONE:
        command = replace(command, relation=Relation.ON)
    return [replace(command, object=thing) for thing in clause.objects] or [command]


def _ask(clause: Clause, missing: str) -> str:
    if not missing:
        return ""
    if missing == "action":
        return _ASKS[missing].format(part=clause.objects[0].text if clause.objects else "it")
    what = clause.objects[0].text if clause.objects else ""
    return _ASKS[missing].format(part=" ".join(filter(None, [clause.action_text, what])))


def even_spans(count: int) -> tuple[Span, ...]:
    """Return made-up times for words that were typed: 0.4 s each."""
    return tuple(Span(_WORD_S * i, _WORD_S * (i + 0.9)) for i in range(count))


def parse_text(text: str, language: str = "en") -> tuple[Command, ...]:
    """Parse typed text; word times are made up from the words' positions."""
    count = sum(not item.is_break for item in split_text(text))
    return grammar_parser(language).parse(text, even_spans(count))


def parse_transcript(transcript: Transcript, language: str | None = None) -> tuple[Command, ...]:
    """Parse what was heard; every part keeps the times of its words."""
    pieces: list[Span] = []
    for word in transcript.words:
        # One recognised word may be several of ours ("left-hand"): they share its time.
        parts = sum(not item.is_break for item in split_text(word.text))
        pieces.extend([Span(word.start_s, word.end_s)] * parts)
    return grammar_parser(language or transcript.language).parse(transcript.text, pieces, transcript.utterance_id)
