# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes of hearing and understanding."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.parameters import check_parameters, parameter

from uncom_language.parser.options import UNDERSTANDING
from uncom_language.speech.audio.samples import SAMPLE_RATE
from uncom_language.speech.endpointing.options import ENDPOINTER, ENDPOINTER_RANGES, VAD_MODES, EndpointerOptions
from uncom_language.speech.options import STREAMING

_PRE_ROLL, _HANG_OVER, _MAX_LENGTH = (ENDPOINTER_RANGES[name] for name in ("pre_roll_s", "hang_over_s", "max_length_s"))


@dataclass(frozen=True, slots=True)
class SpeechConfig:
    """Parameters of speech_node."""

    backend: str = parameter("pocketsphinx", "recogniser: pocketsphinx, whisper")
    language: str = parameter("en", "language of the words")
    model: str = parameter("", "Whisper: folder or hub name; empty: large-v3-turbo")
    audio_topic: str = parameter("/audio", "AudioDataStamped, stamp of the first sample")
    microphone: str = parameter("off", "off, default, or number or part of the name of an input")
    sample_rate: int = parameter(SAMPLE_RATE, "[Hz] until /audio_info says otherwise")
    channels: int = parameter(1, "interleaved, until /audio_info says otherwise", minimum=1)
    sample_format: str = parameter("S16LE", "until /audio_info says otherwise")
    scene_words: tuple[str, ...] = parameter(("",), "further words that may be said")
    backlog_s: float = parameter(STREAMING.backlog_s, "[s] of sound that may wait", minimum=1.0)
    vad_mode: int = parameter(ENDPOINTER.vad_mode, "0 takes most for speech, 3 least", choices=VAD_MODES)
    pre_roll_s: float = parameter(
        ENDPOINTER.pre_roll_s, "[s] kept before the first sound", minimum=_PRE_ROLL[0], maximum=_PRE_ROLL[1]
    )
    hang_over_s: float = parameter(
        ENDPOINTER.hang_over_s,
        "[s] of silence that end an utterance",
        minimum=_HANG_OVER[0],
        maximum=_HANG_OVER[1],
    )
    quick_pause_s: float = parameter(
        STREAMING.complete_pause_s,
        "[s] of silence that end an utterance which is a whole command by then",
        minimum=_HANG_OVER[0],
        maximum=_HANG_OVER[1],
    )
    min_voiced_s: float = parameter(ENDPOINTER.min_voiced_s, "[s] voiced that begin one")
    max_length_s: float = parameter(ENDPOINTER.max_length_s, "[s] after which one is cut", minimum=_MAX_LENGTH[0])
    margin_db: float = parameter(ENDPOINTER.margin_db, "[dB] speech is louder than the background")

    def __post_init__(self) -> None:
        """Refuse unusable values."""
        check_parameters(self)
        self.endpointer()

    def endpointer(self) -> EndpointerOptions:
        """Return the settings of the endpointer."""
        return EndpointerOptions(
            pre_roll_s=self.pre_roll_s,
            hang_over_s=self.hang_over_s,
            min_voiced_s=self.min_voiced_s,
            max_length_s=self.max_length_s,
            margin_db=self.margin_db,
            vad_mode=self.vad_mode,
        )


@dataclass(frozen=True, slots=True)
class LanguageConfig:
    """Parameters of language_node."""

    backend: str = parameter("grammar", "grammar, phi, or both")
    language: str = parameter("en", "language pack: en, de")
    model: str = parameter("", "instruct model: folder or hub name; empty: Phi-4-mini")
    max_alternative_loss: float = parameter(
        UNDERSTANDING.max_alternative_loss,
        "an alternative that is a command is taken if its log score is at most this much lower",
    )
