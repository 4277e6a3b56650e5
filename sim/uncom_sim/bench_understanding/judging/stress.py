# SPDX-License-Identifier: Apache-2.0
"""Stress tests: one difficulty at a time, in steps, on the same takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from uncom_bringup.chain.chain import Chain
from uncom_common.transforms import FloatArray
from uncom_language.types import Act, Transcript, Word
from uncom_perception.types import Hand, HandsFrame, MetricRay, PointingRay
from uncom_reasoner.types import GroundedCommand

from uncom_sim.bench_understanding.judging.ablations import true_transcript
from uncom_sim.bench_understanding.judging.verdict import judge
from uncom_sim.bench_understanding.takes.recording import TakeRecording
from uncom_sim.bench_understanding.takes.take_planning import with_bystanders
from uncom_sim.bench_understanding.takes.types import TakePlan


@dataclass(frozen=True, slots=True)
class Curve:
    """One difficulty: its name, what its levels count, and whether takes have to be filmed anew for each."""

    name: str
    unit: str
    levels: tuple[float, ...]
    filmed: bool


CURVES = (
    Curve("motion blur", "exposure [s]", (0.0, 0.03, 0.06, 0.12), filmed=True),
    Curve("light", "brightness, 1 is a usual room", (0.15, 0.3, 0.6, 1.0), filmed=True),
    Curve("distractors", "further things on the table", (0.0, 2.0, 4.0), filmed=True),
    Curve("landmark noise", "standard deviation [deg]", (0.0, 4.0, 8.0, 16.0, 32.0), filmed=False),
    Curve("word-time error", "shift of all words [s]", (0.0, 0.2, 0.4, 0.8, 1.6), filmed=False),
    Curve("word error rate", "share of words misheard", (0.0, 0.05, 0.1, 0.2, 0.4), filmed=False),
)
# How words are misheard; the paper's own failure first. Others are lost.
CONFUSIONS = {
    "bowl": "ball",
    "mug": "mud",
    "cup": "cap",
    "plate": "late",
    "pan": "pen",
    "lemon": "melon",
    "can": "ten",
    "box": "fox",
    "apple": "ample",
    "orange": "arrange",
    "banana": "bandana",
    "pear": "bear",
    "bottle": "battle",
    "this": "these",
    "that": "at",
    "here": "hear",
    "there": "their",
    "put": "but",
    "take": "tape",
    "in": "and",
    "on": "own",
    "it": "at",
    "the": "a",
    "thing": "think",
    "place": "plays",
    "left": "lift",
    "right": "write",
}


def rerendered_plan(plan: TakePlan, curve: str, level: float) -> TakePlan | None:
    """Return a take under a difficulty that has to be filmed; None if there is no room for it."""
    if curve == "motion blur":
        return replace(plan, conditions=replace(plan.conditions, exposure_s=level))
    if curve == "light":
        return replace(plan, conditions=replace(plan.conditions, light=level))
    return with_bystanders(plan, int(level))


def perturbed_evaluation(chain: Chain, plan: TakePlan, recording: TakeRecording, curve: str) -> Callable[[float], bool]:
    """Return a function from a level to whether the take is right then, for difficulties of words and landmarks.

    The words are the true ones, so that a curve shows its own difficulty alone.
    """
    words = true_transcript(recording)
    hands = chain.detect_hands(recording, words.words[-1].end_s + 2.0, chain.transcribe(recording).attention)

    def right(level: float) -> bool:
        rng = np.random.default_rng([plan.world_seed, 77])
        transcript, seen = words, hands
        if curve == "landmark noise":
            seen = tuple(_with_ray_noise(frame, np.radians(level), rng) for frame in hands)
        elif curve == "word-time error":
            transcript = _shifted(words, level * float(rng.choice((-1.0, 1.0))))
        else:
            transcript = _misheard(words, level, rng)
        return judge(plan, recording.truth.states, _understood(chain, recording, transcript, seen)).right

    return right


def _understood(
    chain: Chain, recording: TakeRecording, transcript: Transcript, hands: tuple[HandsFrame, ...]
) -> GroundedCommand | None:
    commands = [c for c in chain.parse(transcript) if c.act is Act.COMMAND] if transcript.words else []
    done = chain.ground_all(recording, commands[:1], hands)
    return done[0].decision.grounded if done else None


def _shifted(transcript: Transcript, by_s: float) -> Transcript:
    words = tuple(replace(w, start_s=w.start_s + by_s, end_s=w.end_s + by_s) for w in transcript.words)
    return replace(transcript, words=words)


def _misheard(transcript: Transcript, share: float, rng: np.random.Generator) -> Transcript:
    """Mishear words by their own luck, so that those misheard at a level are misheard at every higher one."""
    luck = rng.random(len(transcript.words))
    words: list[Word] = []
    for word, drawn in zip(transcript.words, luck, strict=True):
        if drawn >= share:
            words.append(word)
        elif word.text in CONFUSIONS:
            words.append(replace(word, text=CONFUSIONS[word.text]))
    return replace(transcript, words=tuple(words))


def _with_ray_noise(frame: HandsFrame, sigma_rad: float, rng: np.random.Generator) -> HandsFrame:
    """Turn every ray of a frame by angles of its own; the same luck at every level."""
    hands = []
    for hand in frame.hands:
        angle, axis = rng.normal() * sigma_rad, rng.normal(size=3)
        hands.append(hand if hand.ray is None else replace(hand, ray=_rotated_ray(hand.ray, float(angle), axis)))
    return replace(frame, hands=tuple[Hand, ...](hands))


def _rotated_ray(ray: PointingRay, angle: float, axis: FloatArray) -> PointingRay:
    c, s = np.cos(angle), np.sin(angle)
    u, v = ray.direction
    flat = (float(c * u - s * v), float(s * u + c * v))
    metric = ray.metric
    if metric is not None:
        across = np.cross(metric.direction, axis)
        across = across / max(float(np.linalg.norm(across)), 1e-9)
        metric = MetricRay(metric.origin, metric.tip, c * metric.direction + s * across)
    return replace(ray, direction=flat, metric=metric)
