# SPDX-License-Identifier: Apache-2.0
"""A transcript with its alternatives to commands, by the language back end of a name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from uncom_language.exceptions import AnswerError, UnknownBackendError
from uncom_language.llm.answer_interpretation import agreement_key
from uncom_language.llm.chat_model import DEFAULT_MODEL, ChatModel
from uncom_language.llm.llm_parser import ChatBackend, LlmParser
from uncom_language.parser.grammar_parser import BACKEND, GrammarParser, load_parser, parse_transcript
from uncom_language.parser.lexical.asr_error_correction import correct_nouns
from uncom_language.parser.lexical.translation import translate_references
from uncom_language.parser.options import UNDERSTANDING
from uncom_language.types import Act, Alternative, Command, Transcript

BACKENDS = (BACKEND, "phi", "both")


class LanguageUnderstanding:
    """The grammar, a language model, or both, looking at the recogniser's alternatives where words make no sense."""

    def __init__(
        self,
        backend: str = BACKEND,
        language: str = "en",
        max_alternative_loss: float = UNDERSTANDING.max_alternative_loss,
        make_model: Callable[[], ChatBackend] | None = None,
        model: str = "",
    ) -> None:
        """Load the back end.

        Args:
            backend: "grammar", "phi", or "both": the grammar's commands, with notes on what the model reads otherwise.
            language: name of the language pack.
            max_alternative_loss: how much lower [log score] an alternative may be that is taken instead.
            make_model: makes the language model; by default it is loaded by its name.
            model: folder or hub name of the instruct model; empty: Phi-4-mini-instruct.

        Raises:
            UnknownBackendError: no such back end.
            UnknownLanguageError: there is no such language pack.
            NotInstalledError: the model's libraries are missing.
            ModelNotFoundError: the model's weights are missing.
        """
        if backend not in BACKENDS:
            raise UnknownBackendError("language", backend, BACKENDS)
        self._kind = backend
        self._parser: GrammarParser = load_parser(language)
        self._language = language
        self._max_loss = max_alternative_loss
        self._vocabulary: tuple[str, ...] = ()
        self._llm: LlmParser | None = None
        if backend != BACKEND:
            self._llm = LlmParser(
                make_model() if make_model is not None else ChatModel(model or DEFAULT_MODEL), language
            )

    @property
    def backend(self) -> str:
        """Name of the back end."""
        if self._llm is None:
            return self._parser.backend
        return self._llm.backend if self._kind == "phi" else f"{self._parser.backend} + {self._llm.backend}"

    def understand(self, transcript: Transcript) -> tuple[Command, ...]:
        """Return the commands of a transcript, at least one.

        The best words count. Only if they begin like a command and yet make none does the best alternative that does
        replace them; the commands' notes say so. References are in the words of the English pack, which the detector
        knows, whatever the language.
        """
        if self._kind == "phi":
            commands = self._by_model(transcript)
        else:
            commands = self._by_grammar(transcript)
            if self._llm is not None:
                commands = self._note_agreement(commands, self._by_model(transcript))
        corrected = (
            correct_nouns(command, self._vocabulary, transcript.alternatives, self._language, closed_world=False)
            for command in commands
        )
        return tuple(translate_references(command, self._language) for command in corrected)

    def add_vocabulary(self, words: Iterable[str]) -> None:
        """Add nouns that may be meant; an unknown noun that sounds like one of them is taken for it."""
        self._vocabulary = (*self._vocabulary, *(word for word in words if word not in self._vocabulary))

    def _by_model(self, transcript: Transcript) -> tuple[Command, ...]:
        if self._llm is None:
            return ()
        try:
            return self._llm.parse(transcript)
        except AnswerError as error:
            refused = Command(transcript.utterance_id, Act.REFUSED, transcript.text, reason=str(error))
            return (replace(refused, backend=self._llm.backend),)

    def _note_agreement(self, ours: tuple[Command, ...], models: tuple[Command, ...]) -> tuple[Command, ...]:
        """Note what the model reads otherwise; its reading counts only where the grammar has none."""
        (other,) = models
        first = ours[0]
        if other.act is Act.COMMAND and all(command.act is Act.REFUSED for command in ours):
            note = f"only the language model understands this; the grammar says: {first.reason}"
            return (replace(other, backend=self.backend, notes=(*other.notes, note)),)
        if (other.act, agreement_key(other)) == (first.act, agreement_key(first)):
            note = "the language model agrees"
        else:
            note = f"the language model reads this otherwise: {_describe(other)}"
        return tuple(replace(command, backend=self.backend, notes=(*command.notes, note)) for command in ours)

    def _by_grammar(self, transcript: Transcript) -> tuple[Command, ...]:
        best = parse_transcript(transcript, self._language)
        if not _is_broken(best):
            return best
        for other in transcript.alternatives:
            if other.score < -self._max_loss:
                break
            commands = parse_transcript(replace(transcript, words=other.words), self._language)
            if all(command.act is Act.COMMAND for command in commands) and self._begins_alike(transcript, other):
                note = f"heard {transcript.text!r}; taken as the alternative {other.text!r} ({other.score:.1f})"
                return tuple(replace(command, notes=(*command.notes, note)) for command in commands)
        return best

    def _begins_alike(self, transcript: Transcript, other: Alternative) -> bool:
        """Whether both hypotheses begin with the same word: an alternative never invents the action."""
        return bool(transcript.words and other.words) and transcript.words[0].text == other.words[0].text


def _is_broken(commands: tuple[Command, ...]) -> bool:
    return any(command.act in (Act.REFUSED, Act.INCOMPLETE) for command in commands)


def _describe(command: Command) -> str:
    if command.act is not Act.COMMAND:
        return command.reason
    primitive, relation, reference, place = agreement_key(command)
    return " - ".join(filter(None, [reference, primitive.value, relation.value if place else "", place]))
