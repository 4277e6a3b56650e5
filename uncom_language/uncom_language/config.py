# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes of hearing and understanding."""

from __future__ import annotations

from dataclasses import dataclass, field

from uncom_common.exceptions import InvalidConfigError

from uncom_language.speech.endpointing.options import ENDPOINTER, EndpointerOptions


@dataclass(frozen=True, slots=True)
class SpeechConfig:
    """Parameters of speech_node."""

    backend: str = field(default="pocketsphinx", metadata={"description": "recogniser: pocketsphinx, whisper"})
    language: str = field(default="en", metadata={"description": "language of the words"})
    model: str = field(default="", metadata={"description": "Whisper: folder or hub name; empty: large-v3-turbo"})
    audio_topic: str = field(default="/audio", metadata={"description": "AudioDataStamped, stamp of the first sample"})
    microphone: str = field(
        default="off", metadata={"description": "off, default, or number or part of the name of an input"}
    )
    sample_rate: int = field(default=16000, metadata={"description": "[Hz] until /audio_info says otherwise"})
    channels: int = field(default=1, metadata={"description": "interleaved, until /audio_info says otherwise"})
    sample_format: str = field(default="S16LE", metadata={"description": "until /audio_info says otherwise"})
    scene_words: tuple[str, ...] = field(default=("",), metadata={"description": "further words that may be said"})
    backlog_s: float = field(default=120.0, metadata={"description": "[s] of sound that may wait"})
    vad_mode: int = field(default=ENDPOINTER.vad_mode, metadata={"description": "0 takes most for speech, 3 least"})
    pre_roll_s: float = field(
        default=ENDPOINTER.pre_roll_s, metadata={"description": "[s] kept before the first sound"}
    )
    hang_over_s: float = field(
        default=ENDPOINTER.hang_over_s, metadata={"description": "[s] of silence that end an utterance"}
    )
    quick_pause_s: float = field(
        default=0.18, metadata={"description": "[s] of silence that end an utterance which is a whole command by then"}
    )
    min_voiced_s: float = field(default=ENDPOINTER.min_voiced_s, metadata={"description": "[s] voiced that begin one"})
    max_length_s: float = field(default=ENDPOINTER.max_length_s, metadata={"description": "[s] after which one is cut"})
    margin_db: float = field(
        default=ENDPOINTER.margin_db, metadata={"description": "[dB] speech is louder than the background"}
    )

    def __post_init__(self) -> None:
        """Reject unusable values."""
        if self.backlog_s < 1.0:
            raise InvalidConfigError("backlog_s", self.backlog_s, "must be at least 1 s")
        if not 0.1 <= self.quick_pause_s <= 3.0:
            raise InvalidConfigError("quick_pause_s", self.quick_pause_s, "must be 0.1 to 3 s")
        if self.channels < 1:
            raise InvalidConfigError("channels", self.channels, "must be at least 1")
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

    backend: str = field(default="grammar", metadata={"description": "grammar, phi, or both"})
    language: str = field(default="en", metadata={"description": "language pack: en, de"})
    model: str = field(default="", metadata={"description": "instruct model: folder or hub name; empty: Phi-4-mini"})
    max_alternative_loss: float = field(
        default=6.0,
        metadata={
            "description": "an alternative that is a command is taken if its log score is at most this much lower"
        },
    )
