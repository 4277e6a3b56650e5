# SPDX-License-Identifier: Apache-2.0
"""`uncom parse`: text to commands."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from uncom_common.exceptions import UncomError

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.options import INPUT

if TYPE_CHECKING:
    from uncom_language.types import Command


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "parse",
        help="text -> command(s)",
        description="Understand sentences: one per argument (bare words are one) or one per line of standard input.",
    )
    parser.add_argument("text", nargs="*", metavar="TEXT", help="a sentence; without any, lines of standard input")
    parser.add_argument("--language", default="en", metavar="NAME", help="language pack: en, de (default: en)")
    parser.add_argument(
        "--backend", default="grammar", metavar="NAME", help="grammar, phi, or both with what they disagree on"
    )
    parser.add_argument("--model", default="", metavar="NAME", help="instruct model: a folder or a name on the hub")
    add_json(parser)
    parser.set_defaults(run=run)


def sentences(arguments: Sequence[str]) -> Iterator[str]:
    """Yield what is to be parsed.

    `uncom parse "take the lemon" stop` is two sentences; `uncom parse take the lemon` is one.

    Raises:
        BadInputError: standard input is not text.
    """
    if arguments:
        if any(" " in argument.strip() for argument in arguments):
            yield from arguments
        else:
            yield " ".join(arguments)
        return
    try:
        for line in sys.stdin:
            yield line.rstrip("\n")
    except UnicodeDecodeError:
        raise BadInputError("standard input is not UTF-8 text") from None


def run(options: argparse.Namespace) -> int:
    """Parse each sentence; a refusal with its reason is an answer too."""
    from uncom_language import parser  # noqa: PLC0415  (only when it runs)

    commands = _reader(options)
    for text in sentences(options.text):
        if not text.strip():
            if not options.text:
                continue  # blank lines between sentences are layout
            raise BadInputError("the sentence is empty")
        if len(text) > INPUT.max_sentence_chars:
            raise BadInputError(f"the sentence has {len(text)} characters; at most {INPUT.max_sentence_chars} are read")
        result = parser.sentence_to_json(text, commands(text))
        if options.json:
            output.emit_json(result)
        else:
            for line in in_words(result):
                output.emit(line)
    return 0


def _reader(options: argparse.Namespace) -> Callable[[str], Sequence[Command]]:
    """Return what turns a sentence into commands.

    Raises:
        BadInputError: no such language or back end, or its libraries or weights are missing.
    """
    from uncom_language.language_understanding import LanguageUnderstanding  # noqa: PLC0415

    from uncom_language import parser  # noqa: PLC0415  (only when it runs)

    try:
        if options.backend == "grammar":
            parser.load_parser(options.language)
            return lambda text: parser.parse_text(text, options.language)
        understanding = LanguageUnderstanding(options.backend, options.language, model=options.model)
    except UncomError as error:
        raise BadInputError(str(error)) from error
    return lambda text: understanding.understand(parser.typed_transcript(text, options.language))


def in_words(result: Mapping[str, Any]) -> Iterator[str]:
    """Write a parse for people."""
    yield str(result.get("text", ""))
    commands = result.get("commands") or []
    if not commands:
        yield f"  {result.get('act')}: {result.get('reason') or 'no command'}"
    for command in commands:
        action = command["action"]
        parts = [_reference(command.get("object")), action["primitive"], _reference(command.get("target"))]
        yield f"  {' - '.join(parts)}" + (f"  ({command['relation']})" if command.get("relation") else "")


def _reference(reference: Mapping[str, Any] | None) -> str:
    return str(reference["text"]) if reference else "(none)"
