# SPDX-License-Identifier: Apache-2.0
"""Words to commands with a deterministic grammar (the default language back end), or a language model."""

from uncom_language.parser.command_json import command_to_json, reference_to_json, sentence_to_json
from uncom_language.parser.grammar_parser import (
    GrammarParser,
    load_parser,
    parse_text,
    parse_transcript,
    typed_transcript,
)

__all__ = [
    "GrammarParser",
    "command_to_json",
    "load_parser",
    "parse_text",
    "parse_transcript",
    "reference_to_json",
    "sentence_to_json",
    "typed_transcript",
]
