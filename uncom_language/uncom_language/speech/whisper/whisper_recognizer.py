# SPDX-License-Identifier: Apache-2.0
"""Whisper in Transformers, with word times: the full recogniser (paper, section III-B)."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from uncom_common.pretrained_models import load_pretrained, pick_device, require, weights_format

from uncom_language.exceptions import RecognizerError
from uncom_language.speech.audio.samples import SAMPLE_RATE, FloatArray, as_float, resample, to_int16
from uncom_language.speech.recognition.recognizer import Recognition, Recognizer, Samples
from uncom_language.speech.recognition.utterance_verification import rejection_reason
from uncom_language.speech.whisper.options import WHISPER, WhisperOptions
from uncom_language.types import Alternative, Word

DEFAULT_MODEL = "openai/whisper-large-v3-turbo"


class WhisperRecognizer(Recognizer):
    """Whisper of any size.

    Word times are those of cross attention, as Transformers >= 4.50 gives them (before, a word's start was its end).
    Sound longer than 30 s is taken in overlapping chunks.
    """

    def __init__(
        self, model: str = DEFAULT_MODEL, language: str = "en", device: str = "auto", options: WhisperOptions = WHISPER
    ) -> None:
        """Load the model.

        Args:
            model: folder, or name on the model hub.
            language: language tag of the speech.
            device: "auto" takes a GPU where there is one (bfloat16), else the processor (float32).
            options: how sound is cut, and how many hypotheses are searched for.

        Raises:
            NotInstalledError: torch or transformers is missing.
            ModelNotFoundError: no weights in the folder, the cache, or on the hub.
        """
        transformers = require("transformers")
        self._language = language
        self._name = model
        self._options = options
        self._hypotheses = max(1, options.hypotheses)
        self._lock = threading.Lock()
        self._device = pick_device(device)
        self._dtype = weights_format(self._device)
        processor = load_pretrained(transformers.AutoProcessor, model)
        weights = load_pretrained(
            transformers.AutoModelForSpeechSeq2Seq,
            model,
            dtype=self._dtype,
            attn_implementation="eager",  # the cross attention that word times come from
        )
        self._processor = processor
        self._model = weights.to(self._device).eval()
        self._pipeline = transformers.pipeline(
            "automatic-speech-recognition",
            model=self._model,
            tokenizer=processor.tokenizer,
            feature_extractor=processor.feature_extractor,
            device=self._device,
            dtype=self._dtype,
        )

    @property
    def backend(self) -> str:
        """Name and weights."""
        return f"whisper ({self._name})"

    @property
    def language(self) -> str:
        """Language tag of the words."""
        return self._language

    def transcribe(self, samples: Samples, sample_rate: int) -> Recognition:
        """Recognise one utterance, or a long recording in chunks."""
        sound = resample(as_float(samples), sample_rate)
        if sound.size < round(self._options.min_sound_s * SAMPLE_RATE):
            return Recognition(reason="too short for a word")
        if 20.0 * math.log10(float(np.sqrt(np.mean(sound**2))) + 1e-9) < self._options.min_level_db:
            return Recognition(reason="silence")
        with self._lock:
            words = self._words(sound)
            if not words:
                return Recognition(reason="no words in it")
            reason = rejection_reason(to_int16(sound), words)
            if reason:
                return Recognition(reason=reason)
            return Recognition(words, self._alternatives(sound, words))

    def _prompt(self) -> dict[str, Any]:
        """Return what a multilingual model is told; an English-only one takes neither language nor task."""
        multilingual = bool(getattr(self._model.generation_config, "is_multilingual", False))
        return {"language": self._language, "task": "transcribe"} if multilingual else {}

    def _words(self, sound: FloatArray) -> tuple[Word, ...]:
        options: dict[str, Any] = {"return_timestamps": "word", "generate_kwargs": self._prompt()}
        if sound.size > self._options.chunk_s * SAMPLE_RATE:
            options |= {"chunk_length_s": self._options.chunk_s, "stride_length_s": self._options.stride_s}
        try:
            made = self._pipeline({"raw": sound, "sampling_rate": SAMPLE_RATE}, **options)
        except (ValueError, RuntimeError, IndexError) as error:
            raise RecognizerError(f"Whisper failed: {str(error).partition(chr(10))[0]}") from error
        return words_of_chunks(made.get("chunks", ()), sound.size / SAMPLE_RATE, self._options)

    def _alternatives(self, sound: FloatArray, words: Sequence[Word]) -> tuple[Alternative, ...]:
        """Return other hypotheses of a beam search; their words share the time of the whole."""
        if self._hypotheses == 1 or sound.size > self._options.chunk_s * SAMPLE_RATE:
            return ()
        torch = require("torch")
        features = self._processor(sound, sampling_rate=SAMPLE_RATE, return_tensors="pt").input_features
        with torch.inference_mode():
            made = self._model.generate(
                features.to(self._device, self._dtype),
                num_beams=self._hypotheses,
                num_return_sequences=self._hypotheses,
                return_dict_in_generate=True,
                output_scores=True,
                **self._prompt(),
            )
        texts = self._processor.batch_decode(made.sequences, skip_special_tokens=True)
        lengths = [int((row != self._model.config.pad_token_id).sum()) for row in made.sequences]
        scores = getattr(made, "sequences_scores", None)
        logs = (
            [float(score) * length for score, length in zip(scores, lengths, strict=True)] if scores is not None else []
        )
        best_text = " ".join(word.text for word in words)
        found: dict[str, float] = {}
        for text, score in zip(texts, logs, strict=False):
            plain = " ".join(plain_word(word) for word in text.split())
            if plain and plain != best_text:
                found.setdefault(plain, score)
        top = max(logs, default=0.0)
        start, end = words[0].start_s, words[-1].end_s
        return tuple(
            Alternative(_spread_evenly(text.split(), start, end), min(0.0, score - top))
            for text, score in found.items()
        )


def words_of_chunks(
    chunks: Sequence[Mapping[str, Any]], length_s: float, options: WhisperOptions = WHISPER
) -> tuple[Word, ...]:
    """Return the words of a pipeline's chunks with times in order and within the sound.

    A missing end time (the last word of a cut sound) is the end of the sound; a word without length gets a frame.
    """
    words: list[Word] = []
    before = 0.0
    for chunk in chunks:
        text = plain_word(str(chunk["text"]))
        if not text:
            continue
        start, end = chunk["timestamp"]
        start_s = min(max(before, before if start is None else float(start)), length_s)
        end_s = min(
            max(start_s + options.min_word_s, length_s if end is None else float(end)),
            max(length_s, start_s + options.min_word_s),
        )
        words.append(Word(text, start_s, end_s))
        before = start_s
    return tuple(words)


def plain_word(text: str) -> str:
    """Return a word in lower case without punctuation around it."""
    return text.strip().lower().strip('.,;:!?"()[]…-')


def _spread_evenly(words: Sequence[str], start_s: float, end_s: float) -> tuple[Word, ...]:
    step = (end_s - start_s) / max(1, len(words))
    return tuple(Word(text, start_s + step * i, start_s + step * (i + 1), 0.0) for i, text in enumerate(words))
