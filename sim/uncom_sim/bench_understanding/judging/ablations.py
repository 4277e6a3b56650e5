# SPDX-License-Identifier: Apache-2.0
"""Ablations: the same take without one source, with a perfect source, or by the paper's rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from uncom_bringup.chain.chain import Chain, ChainResult, Grounding
from uncom_language.types import Act, Command, Reference, Transcript, Word
from uncom_perception.types import HandsFrame
from uncom_reasoner.detector_phrases import is_place_word
from uncom_reasoner.types import Evidence, GroundedCommand

from uncom_sim.bench_understanding.judging.failure_stage import same_request
from uncom_sim.bench_understanding.judging.ground_truth_scene import true_scene
from uncom_sim.bench_understanding.judging.paper_rules import decide_as_published
from uncom_sim.bench_understanding.judging.verdict import Verdict, judge
from uncom_sim.bench_understanding.takes.recording import TakeRecording
from uncom_sim.bench_understanding.takes.types import TakePlan

_MARKS = ".,!?;:\"'"


@dataclass(frozen=True, slots=True)
class AblationResults:
    """What the variants of one take came to; true_command is what perfect hearing would have given.

    swapped_fits tells that the swapped sentence asks for the same as the take's own.
    """

    verdicts: dict[str, Verdict]
    true_command: Command | None
    swapped_fits: bool = False


def run_ablations(
    chain: Chain, plan: TakePlan, recording: TakeRecording, result: ChainResult, first: Grounding | None, swapped: str
) -> AblationResults:
    """Decide a take in every other way; swapped is the sentence of another take ("" for none)."""
    states, hands = recording.truth.states, result.hands
    true = _grounded(chain, recording, true_transcript(recording), hands, first)
    verdicts = {"true_words": judge(plan, states, true.decision.grounded if true else None)}
    evidence = first.evidence if first is not None else None

    def verdict(changed: Evidence | None) -> Verdict:
        if changed is None:
            return judge(plan, states, None)
        return judge(plan, states, chain.decide(changed).grounded)

    verdicts["published"] = judge(plan, states, _published(evidence, hands))
    verdicts["true_detections"] = verdict(_with_true_scene(evidence, plan, recording))
    verdicts["no_gesture"] = verdict(None if evidence is None else replace(evidence, rays=()))
    verdicts["gesture_only"] = verdict(None if evidence is None else _without_words(evidence))
    fits = False
    if swapped:
        other = _grounded(chain, recording, retime_sentence(swapped, recording), hands, first)
        verdicts["swapped_words"] = judge(plan, states, other.decision.grounded if other else None)
        fits = true is not None and other is not None and same_request(true.command, other.command)
    return AblationResults(verdicts, true.command if true else None, fits)


def true_transcript(recording: TakeRecording) -> Transcript:
    """Return what was said, as perfect hearing would give it."""
    words = tuple(
        Word(text, word.start_s, word.end_s)
        for word in recording.truth.words
        if (text := word.text.lower().strip(_MARKS))
    )
    return Transcript("true", words)


def retime_sentence(sentence: str, recording: TakeRecording) -> Transcript:
    """Return another sentence as if it had been said in this take, its words spread over the time of the true ones."""
    words = recording.truth.words
    texts = sentence.lower().split()
    edges = np.array([*(w.start_s for w in words), words[-1].end_s])
    times = np.interp(np.linspace(0.0, 1.0, len(texts) + 1), np.linspace(0.0, 1.0, len(edges)), edges)
    spans = zip(texts, times[:-1], times[1:], strict=True)
    return Transcript("swapped", tuple(Word(text.strip(_MARKS), float(a), float(b)) for text, a, b in spans))


def _grounded(
    chain: Chain, recording: TakeRecording, transcript: Transcript, hands: Sequence[HandsFrame], known: Grounding | None
) -> Grounding | None:
    commands = chain.parse(transcript)
    evidence = (known.evidence,) if known is not None and known.evidence is not None else ()
    done = chain.ground_all(recording, commands, hands, known=evidence)
    return next((g for g in done if g.command.act is Act.COMMAND), next(iter(done), None))


def _published(evidence: Evidence | None, hands: Sequence[HandsFrame]) -> GroundedCommand | None:
    return None if evidence is None else decide_as_published(evidence, hands)


def _with_true_scene(evidence: Evidence | None, plan: TakePlan, recording: TakeRecording) -> Evidence | None:
    if evidence is None or evidence.view.transform_camera_to_scene is None:
        return None
    scene = true_scene(
        recording.truth.states,
        plan.scene.table,
        evidence.phrases,
        recording.camera,
        evidence.view.transform_camera_to_scene,
        evidence.scene.stamp_s,
    )
    return replace(evidence, scene=scene)


def _without_words(evidence: Evidence) -> Evidence:
    """Let every named object be "this thing"; what is to be done, and where, stays."""
    command = evidence.command
    return replace(
        evidence, command=replace(command, object=_as_deictic(command.object), target=_as_deictic(command.target))
    )


def _as_deictic(reference: Reference | None) -> Reference | None:
    if reference is None or is_place_word(reference):
        return reference
    plain = Reference("this thing", "thing", reference.span, concrete=False, deictic="this", order=reference.order)
    return replace(plain, deictic_span=reference.deictic_span or reference.span)
