# SPDX-License-Identifier: Apache-2.0
"""Words to a command with a language model: the paper's two prompts in one conversation (section III-C)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import yaml

from uncom_language.exceptions import AnswerError, UnknownLanguageError
from uncom_language.llm.answer_interpretation import command_from_answer
from uncom_language.llm.answer_schema import answer_schema, validate_answer
from uncom_language.llm.options import CHAT
from uncom_language.parser.options import TYPED_TEXT
from uncom_language.types import Act, Command, Transcript, Word

PACKS = Path(__file__).parent / "packs"


class ChatBackend(Protocol):
    """What the parser needs of a model."""

    name: str

    def answer(self, messages: list[Mapping[str, str]], schema: Mapping[str, Any]) -> str:
        """Return the answer to a conversation."""


@cache
def load_prompts(language: str) -> tuple[str, str, tuple[Mapping[str, Any], ...]]:
    """Return both prompts and the examples of a language.

    Raises:
        UnknownLanguageError: there are no prompts in it.
    """
    folder = PACKS / language
    if not folder.is_dir():
        raise UnknownLanguageError(language, sorted(path.name for path in PACKS.iterdir()))
    shots = yaml.safe_load((folder / "few_shots.yaml").read_text(encoding="utf-8"))
    extract, refine = ((folder / name).read_text(encoding="utf-8").strip() for name in ("extract.txt", "refine.txt"))
    return extract, refine, tuple(shots)


class LlmParser:
    """Asks a model twice: what object, action and target are, then which of them are concrete."""

    def __init__(self, model: ChatBackend, language: str = "en") -> None:
        """Take the model, and read the prompts of a language.

        Raises:
            UnknownLanguageError: there are no prompts in the language.
        """
        self._model = model
        self._language = language
        self._extract, self._refine, self._shots = load_prompts(language)

    @property
    def backend(self) -> str:
        """Name of the model."""
        return f"phi ({self._model.name})"

    def parse(self, transcript: Transcript) -> tuple[Command, ...]:
        """Return the command of a transcript.

        Raises:
            AnswerError: the model gave no usable answer, not even when told what was wrong.
        """
        if not transcript.words:
            return (Command(transcript.utterance_id, Act.REFUSED, "", reason="I heard no words", backend=self.backend),)
        messages = [{"role": "system", "content": self._extract}, *self._examples()]
        messages.append({"role": "user", "content": whisper_json(transcript.words)})
        self._ask(messages, transcript, refined=False)
        messages.append({"role": "user", "content": self._refine})
        answer = self._ask(messages, transcript, refined=True)
        return (command_from_answer(answer, transcript, self._language, self.backend),)

    def _ask(self, messages: list[dict[str, str]], transcript: Transcript, *, refined: bool) -> dict[str, Any]:
        """Ask, and once more with the error; the answer becomes part of the conversation."""
        schema = answer_schema(refined=refined)
        why = ""
        for _ in range(1 + CHAT.max_retries):
            text = self._model.answer([dict(message) for message in messages], schema)
            messages.append({"role": "assistant", "content": text})
            try:
                return validate_answer(text, refined=refined, words=transcript.text)
            except AnswerError as error:
                why = str(error)
                messages.append({"role": "user", "content": f"That cannot be used: {why}. Answer again, JSON only."})
        raise AnswerError(f"{self._model.name} gave no usable answer: {why}")

    def _examples(self) -> list[dict[str, str]]:
        step_s = TYPED_TEXT.word_s
        made: list[dict[str, str]] = []
        for shot in self._shots:
            words = tuple(
                Word(text, step_s * i, round(step_s * (i + TYPED_TEXT.voiced_share), CHAT.time_digits))
                for i, text in enumerate(shot["words"].split())
            )
            refined = {
                name: {**part, "concrete": shot["concrete"][name]} if name in shot["concrete"] else part
                for name, part in shot["extracted"].items()
            }
            made += [
                {"role": "user", "content": whisper_json(words)},
                {"role": "assistant", "content": json.dumps(shot["extracted"])},
                {"role": "user", "content": self._refine},
                {"role": "assistant", "content": json.dumps(refined)},
            ]
        return made


def whisper_json(words: tuple[Word, ...]) -> str:
    """Return words as Whisper's JSON: text, and chunks with timestamps [s]."""
    return json.dumps(
        {
            "text": " ".join(word.text for word in words),
            "chunks": [
                {
                    "text": word.text,
                    "timestamp": [round(word.start_s, CHAT.time_digits), round(word.end_s, CHAT.time_digits)],
                }
                for word in words
            ],
        }
    )
