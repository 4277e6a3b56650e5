# SPDX-License-Identifier: Apache-2.0
"""`uncom transcribe`: sound to words with times."""

from __future__ import annotations

import argparse

from uncom_common.exceptions import UncomError

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, existing_file
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("transcribe", help="sound file -> words with times")
    parser.add_argument("file", metavar="FILE", help="WAV, FLAC, MP3, MP4, ...")
    parser.add_argument("--backend", default="pocketsphinx", metavar="NAME", help="pocketsphinx or whisper")
    parser.add_argument("--language", default="en", metavar="TAG", help="language of the speech (default: en)")
    parser.add_argument("--model", default="", metavar="NAME", help="Whisper: a folder or a name on the hub")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Transcribe; no words is an answer too."""
    path = existing_file(options.file)

    from uncom_language import speech  # noqa: PLC0415  (only when it runs)

    try:
        transcript = speech.transcribe_file(path, options.backend, options.language, options.model)
    except UncomError as error:
        raise BadInputError(str(error)) from error
    result = speech.transcript_to_json(transcript)
    if options.json:
        output.emit_json(result)
    else:
        output.emit(result["text"] or "(no speech was understood)")
        for word in result["words"]:
            output.emit(f"  {word['start']:7.2f} {word['end']:7.2f}  {word['confidence']:4.2f}  {word['text']}")
    return 0
