# SPDX-License-Identifier: Apache-2.0
"""Sound to words with times."""

from uncom_language.speech.factory import make_recognizer
from uncom_language.speech.files import transcribe_file, transcript_to_json

__all__ = ["make_recognizer", "transcribe_file", "transcript_to_json"]
