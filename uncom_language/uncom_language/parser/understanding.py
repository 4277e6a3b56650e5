# SPDX-License-Identifier: Apache-2.0
"""A transcript with its alternatives to commands."""

from __future__ import annotations

from dataclasses import replace

from uncom_language.exceptions import UnknownBackendError
from uncom_language.parser.commands import BACKEND, GrammarParser, grammar_parser, parse_transcript
from uncom_language.parser.translation import in_detector_words
from uncom_language.types import Act, Alternative, Command, Transcript


class Understanding:
    """The language back end of a name, looking at the recogniser's alternatives where the best words make no sense."""

    def __init__(self, backend: str = BACKEND, language: str = "en", max_alternative_loss: float = 6.0) -> None:
        """Load the back end.

        Args:
            backend: "grammar".
            language: name of the language pack.
            max_alternative_loss: how much lower [log score] an alternative may be that is taken instead.

        Raises:
            UnknownBackendError: no such back end, or it is not installed.
            UnknownLanguageError: there is no such language pack.
        """
        if backend != BACKEND:
            hint = "the full models are not installed" if backend in ("phi", "phi4", "llm") else ""
            raise UnknownBackendError("language", backend, (BACKEND,), hint)
        self._parser: GrammarParser = grammar_parser(language)
        self._language = language
        self._max_loss = max_alternative_loss

    @property
    def backend(self) -> str:
        """Name of the back end."""
        return self._parser.backend

    def understand(self, transcript: Transcript) -> tuple[Command, ...]:
        """Return the commands of a transcript, at least one.

        The best words count. Only if they begin like a command and yet make none does the best alternative that does
        replace them; the commands' notes say so. References are in the words of the English pack, which the detector
        knows, whatever the language.
        """
        return tuple(in_detector_words(command, self._language) for command in self._read(transcript))

    def _read(self, transcript: Transcript) -> tuple[Command, ...]:
        best = parse_transcript(transcript, self._language)
        if not _is_broken(best):
            return best
        for other in transcript.alternatives:
            if other.score < -self._max_loss:
                break
            commands = parse_transcript(replace(transcript, words=other.words), self._language)
            if all(command.act is Act.COMMAND for command in commands) and self._close(transcript, other):
                note = f"heard {transcript.text!r}; taken as the alternative {other.text!r} ({other.score:.1f})"
                return tuple(replace(command, notes=(*command.notes, note)) for command in commands)
        return best

    def _close(self, transcript: Transcript, other: Alternative) -> bool:
        """Whether both hypotheses begin with the same word: an alternative never invents the action."""
        return bool(transcript.words and other.words) and transcript.words[0].text == other.words[0].text


def _is_broken(commands: tuple[Command, ...]) -> bool:
    return any(command.act in (Act.REFUSED, Act.INCOMPLETE) for command in commands)
