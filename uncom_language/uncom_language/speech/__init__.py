# SPDX-License-Identifier: Apache-2.0
"""Sound to words with times."""

from uncom_language.speech.file_transcription import transcribe_file, transcript_to_json
from uncom_language.speech.recognizer_factory import make_recognizer

__all__ = ["make_recognizer", "transcribe_file", "transcript_to_json"]
