# SPDX-License-Identifier: Apache-2.0
"""Measures the default recogniser on synthesised voices that nothing was adapted to: words, times, load, latency.

Sound goes through the same listener as on the robot, in chunks of 50 ms. Latency is counted from the last sample of
speech to the command: sound that had to pass plus processor time. Run from the workspace:

    ./uncom exec python sim/tools/measure_speech.py [--sentences 12] [--snr 20]
"""

from __future__ import annotations

import argparse
import importlib
import json
import random
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import yaml
from rapidfuzz.distance import Levenshtein
from uncom_language.parser import parse_transcript
from uncom_language.parser.end_of_turn import end_of_turn_pause_s
from uncom_language.speech.endpointing.options import EndpointerOptions
from uncom_language.speech.options import STREAMING
from uncom_language.speech.recognizer_factory import make_recognizer
from uncom_language.speech.streaming_transcriber import StreamingTranscriber, TranscriberOptions
from uncom_language.types import Transcript

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "uncom_language" / "test" / "data" / "sentences.yaml"
SIMULATED_SPEECH = ROOT / "sim" / "test" / "language"
VOICES = (
    "en-us",
    "en",
    "en-us+m3",
    "en-us+m7",
    "en-us+f2",
    "en-us+f4",
    "en-us+Andy",
    "en+m1",
    "en+f3",
    "en-gb-x-rp+m1",
)
KINDS = ("paper_rows", "plain", "deixis", "nested", "groups", "choices")
# Words without a common pronunciation, and what is no word.
EXCLUDED_WORDS = ("gizmo", "flange", "doll", "stapler", ".")
RATE = 16000
CHUNK_S = 0.05
LOUD_SHARE = 0.02  # of the peak: what is louder is speech
COMPLETE_PAUSE_S, HANG_OVER_S = STREAMING.complete_pause_s, 0.6


def sentences(count: int, seed: int) -> list[str]:
    """Draw sentences of the test corpus."""
    raw = yaml.load(CORPUS.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)  # noqa: S506 - all scalars as text
    candidates = [text for kind in KINDS for text in raw[kind] if not any(word in text for word in EXCLUDED_WORDS)]
    return random.Random(seed).sample(candidates, min(count, len(candidates)))


class TranscriberUnderTest:
    """Transcribes one utterance after another as a stream, and measures when commands are known."""

    def __init__(self, complete_pause_s: float) -> None:
        """Start the transcriber; `complete_pause_s` [s] is the pause that ends a whole command."""
        self.transcripts: list[Transcript] = []
        self.clock_s = 0.0
        self.cpu_s = 0.0
        end_of_turn = (
            (lambda words: end_of_turn_pause_s(words, complete_pause_s, HANG_OVER_S))
            if complete_pause_s < HANG_OVER_S
            else None
        )
        options = TranscriberOptions(
            EndpointerOptions(hang_over_s=HANG_OVER_S), "measure", end_of_turn_pause_s=end_of_turn
        )
        self.transcriber = StreamingTranscriber(make_recognizer, self.transcripts.append, lambda _: None, options)
        self.transcriber.start()

    def transcribe(self, samples: np.ndarray) -> tuple[list[Transcript], float]:
        """Return what was heard, and when [s from the first sample] the first of it was known as commands."""
        before, start_s = len(self.transcripts), self.clock_s
        command_s = 0.0
        step = round(CHUNK_S * RATE)
        for position in range(0, len(samples), step):
            piece = samples[position : position + step]
            began = process_time()
            self.transcriber.feed(piece, RATE, self.clock_s)
            self.transcriber.wait_until_idle(60.0)
            self.clock_s += len(piece) / RATE
            if len(self.transcripts) > before and not command_s:
                parse_transcript(self.transcripts[-1])
                command_s = self.clock_s - start_s + process_time() - began
            self.cpu_s += process_time() - began
        return self.transcripts[before:], command_s


@dataclass
class Measurements:
    """What the utterances of all voices came to."""

    words: int = 0
    errors: int = 0  # words inserted, left out or replaced
    sound_s: float = 0.0
    split_utterances: int = 0
    latencies_s: list[float] = field(default_factory=list)
    word_start_errors_s: list[float] = field(default_factory=list)


def measure_sentence(
    transcriber: TranscriberUnderTest, sentence: str, voice: str, index: int, snr_db: float, total: Measurements
) -> str:
    """Speak and transcribe a sentence, add to the measurements, and return the text that was recognised."""
    say = simulated_speech().say
    speed, pitch = 140 + 5 * (index % 5), 40 + 2 * index
    spoken = say(sentence, voice, speed, pitch, 0.5, 1.2, snr_db, index)
    quiet = say(sentence, voice, speed, pitch, 0.5, 1.2)
    loud = np.abs(quiet.samples.astype(float)) > LOUD_SHARE * np.abs(quiet.samples).max()
    end_s = float(np.flatnonzero(loud)[-1]) / RATE
    start_s = transcriber.clock_s
    transcripts, command_s = transcriber.transcribe(spoken.samples)
    text = " ".join(transcript.text for transcript in transcripts)
    total.errors += Levenshtein.distance(sentence.split(), text.split())
    total.words += len(sentence.split())
    total.sound_s += len(spoken.samples) / RATE
    total.split_utterances += len(transcripts) > 1
    if transcripts:
        total.latencies_s.append(command_s - end_s)
    timed = [word for transcript in transcripts for word in transcript.words]
    if text == sentence and len(timed) == len(spoken.starts):
        pairs = zip(timed, spoken.starts, strict=True)
        total.word_start_errors_s += [abs(word.start_s - start_s - true_s) for word, true_s in pairs]
    return text


@cache
def simulated_speech() -> Any:
    """Import the simulated speaker, which lies beside the tests of hearing."""
    sys.path.insert(0, str(SIMULATED_SPEECH))
    return importlib.import_module("simulated_speech")


def main() -> None:
    """Measure and print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=10)
    parser.add_argument("--snr", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--voices", nargs="*", default=VOICES)
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--quick", type=float, default=COMPLETE_PAUSE_S)
    options = parser.parse_args()
    transcriber = TranscriberUnderTest(options.quick)
    transcriber.transcribe(np.zeros(RATE, np.int16))  # wait for the recogniser
    transcriber.cpu_s = 0.0
    total = Measurements()
    by_voice: dict[str, float] = {}
    for number, voice in enumerate(options.voices):
        errors, words = total.errors, total.words
        for index, sentence in enumerate(sentences(options.sentences, options.seed + number)):
            text = measure_sentence(transcriber, sentence, voice, index, options.snr, total)
            if options.verbose and text != sentence:
                sys.stderr.write(f"{voice}: {sentence}\n    {text}\n")
        by_voice[voice] = round((total.errors - errors) / (total.words - words), 3)
    transcriber.transcriber.stop()
    sys.stdout.write(json.dumps(result(total, by_voice, transcriber.cpu_s, options.snr)) + "\n")


def result(total: Measurements, by_voice: dict[str, float], cpu_s: float, snr_db: float) -> dict[str, Any]:
    """Return what is printed."""
    return {
        "word_error_rate": round(total.errors / total.words, 4),
        "by_voice": by_voice,
        "real_time_factor": round(cpu_s / total.sound_s, 3),
        "latency_s": {
            "median": round(float(np.median(total.latencies_s)), 3),
            "90th": round(float(np.percentile(total.latencies_s, 90)), 3),
        },
        "word_start_error_s": {"median": round(float(np.median(total.word_start_errors_s)), 3)},
        "utterances": len(total.latencies_s),
        "cut_in_two": total.split_utterances,
        "snr_db": snr_db,
    }


if __name__ == "__main__":
    main()
