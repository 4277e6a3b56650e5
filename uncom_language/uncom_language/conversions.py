# SPDX-License-Identifier: Apache-2.0
"""Values of hearing and understanding to messages and back, in pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from uncom_common.conversions import (
    header_to_msg,
    primitive_from_msg,
    primitive_to_msg,
    seconds_from_msg,
    time_to_msg,
)

from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.msg import Reference as ReferenceMsg
from uncom_interfaces.msg import SpeechStatus as SpeechStatusMsg
from uncom_interfaces.msg import Transcript as TranscriptMsg
from uncom_interfaces.msg import TranscriptAlternative as AlternativeMsg
from uncom_interfaces.msg import Vocabulary as VocabularyMsg
from uncom_interfaces.msg import Word as WordMsg
from uncom_language.exceptions import LexiconError
from uncom_language.speech.speech_status import SpeechState, SpeechStatus
from uncom_language.types import Act, Alternative, Command, Reference, Relation, Span, Transcript, Word


def word_to_msg(word: Word) -> WordMsg:
    """Write a word."""
    return WordMsg(
        text=word.text, start=time_to_msg(word.start_s), end=time_to_msg(word.end_s), confidence=float(word.confidence)
    )


def word_from_msg(msg: WordMsg) -> Word:
    """Read a word."""
    return Word(msg.text, seconds_from_msg(msg.start), seconds_from_msg(msg.end), float(msg.confidence))


def transcript_to_msg(transcript: Transcript) -> TranscriptMsg:
    """Write a transcript; its stamp is the end of the last word."""
    words = transcript.words
    return TranscriptMsg(
        header=header_to_msg(words[-1].end_s if words else 0.0, ""),
        utterance_id=transcript.utterance_id,
        text=transcript.text,
        words=[word_to_msg(word) for word in words],
        alternatives=[
            AlternativeMsg(text=other.text, words=[word_to_msg(word) for word in other.words], score=float(other.score))
            for other in transcript.alternatives
        ],
        language=transcript.language,
        backend=transcript.backend,
        latency_s=float(transcript.latency_s),
    )


def transcript_from_msg(msg: TranscriptMsg) -> Transcript:
    """Read a transcript."""
    return Transcript(
        utterance_id=msg.utterance_id,
        words=tuple(word_from_msg(word) for word in msg.words),
        alternatives=tuple(
            Alternative(tuple(word_from_msg(word) for word in other.words), float(other.score))
            for other in msg.alternatives
        ),
        language=msg.language,
        backend=msg.backend,
        latency_s=float(msg.latency_s),
    )


def reference_to_msg(reference: Reference | None, anchors: list[ReferenceMsg]) -> ReferenceMsg:
    """Write a reference; the things that locate it are appended to `anchors`, to which it points by index."""
    if reference is None:
        return ReferenceMsg(present=False, anchor=-1)
    deictic = reference.deictic_span or reference.span
    msg = ReferenceMsg(
        present=True,
        text=reference.text,
        head=reference.head,
        modifiers=list(reference.modifiers),
        concrete=reference.concrete,
        deictic=reference.deictic,
        anaphoric=reference.anaphoric,
        other=reference.other,
        quantity=reference.quantity,
        start=time_to_msg(reference.span.start_s),
        end=time_to_msg(reference.span.end_s),
        deictic_start=time_to_msg(deictic.start_s),
        deictic_end=time_to_msg(deictic.end_s),
        order=reference.order,
        anchor_relation=reference.anchor_relation,
        anchor=-1,
        excluded_modifiers=list(reference.excluded_modifiers),
        ordinal=reference.ordinal,
        ordinal_side=reference.ordinal_side,
        comparison=reference.comparison,
        compared_to=-1,
        heard=reference.heard,
    )
    if reference.anchor is not None:
        msg.anchor = _append(reference.anchor, anchors)
    if reference.compared_to is not None:
        msg.compared_to = _append(reference.compared_to, anchors)
    return msg


def _append(reference: Reference, anchors: list[ReferenceMsg]) -> int:
    """Write a reference behind those that it needs itself; return its index."""
    msg = reference_to_msg(reference, anchors)
    anchors.append(msg)
    return len(anchors) - 1


def reference_from_msg(msg: ReferenceMsg, anchors: Sequence[ReferenceMsg]) -> Reference | None:
    """Read a reference with the things that locate it; None if it is not present."""
    if not msg.present:
        return None
    deictic_span = Span(seconds_from_msg(msg.deictic_start), seconds_from_msg(msg.deictic_end))
    return Reference(
        text=msg.text,
        head=msg.head,
        span=Span(seconds_from_msg(msg.start), seconds_from_msg(msg.end)),
        modifiers=tuple(msg.modifiers),
        concrete=bool(msg.concrete),
        deictic=msg.deictic,
        deictic_span=deictic_span if msg.deictic else None,
        anaphoric=bool(msg.anaphoric),
        other=bool(msg.other),
        quantity=int(msg.quantity),
        order=int(msg.order),
        anchor_relation=msg.anchor_relation,
        anchor=_at(int(msg.anchor), anchors),
        excluded_modifiers=tuple(msg.excluded_modifiers),
        ordinal=int(msg.ordinal),
        ordinal_side=msg.ordinal_side,
        comparison=msg.comparison,
        compared_to=_at(int(msg.compared_to), anchors),
        heard=msg.heard,
    )


def _at(index: int, anchors: Sequence[ReferenceMsg]) -> Reference | None:
    """Read the anchor of an index; its own anchors always have smaller ones, so this ends."""
    return reference_from_msg(anchors[index], anchors[:index]) if 0 <= index < len(anchors) else None


def command_to_msg(command: Command, stamp_s: float) -> CommandMsg:
    """Write a command; `stamp_s` [s] is the end of the utterance it was taken from."""
    anchors: list[ReferenceMsg] = []
    action = command.action_span or Span(0.0, 0.0)
    msg = CommandMsg(
        header=header_to_msg(stamp_s, ""),
        utterance_id=command.utterance_id,
        index=command.index,
        count=command.count,
        act=int(command.act),
        reason=command.reason,
        text=command.text,
        action_text=command.action_text,
        primitive=primitive_to_msg(command.primitive),
        action_start=time_to_msg(action.start_s),
        action_end=time_to_msg(action.end_s),
        object=reference_to_msg(command.object, anchors),
        target=reference_to_msg(command.target, anchors),
        reference2=reference_to_msg(command.reference2, anchors),
        relation=command.relation.value,
        backend=command.backend,
        distance_m=float(command.distance_m),
        notes=list(command.notes),
    )
    msg.anchors = anchors
    return msg


def command_from_msg(msg: CommandMsg) -> Command:
    """Read a command.

    Raises:
        ValueError: act, primitive or relation is not one that is known.
    """
    anchors = list(msg.anchors)
    span = Span(seconds_from_msg(msg.action_start), seconds_from_msg(msg.action_end))
    return Command(
        utterance_id=msg.utterance_id,
        act=Act(msg.act),
        text=msg.text,
        action_text=msg.action_text,
        primitive=primitive_from_msg(msg.primitive),
        action_span=span if msg.action_text else None,
        object=reference_from_msg(msg.object, anchors),
        target=reference_from_msg(msg.target, anchors),
        reference2=reference_from_msg(msg.reference2, anchors),
        relation=Relation(msg.relation or "none"),
        reason=msg.reason,
        index=int(msg.index),
        count=int(msg.count),
        backend=msg.backend,
        notes=tuple(msg.notes),
        distance_m=round(float(msg.distance_m), 6),  # float32 on the wire
    )


def speech_status_to_msg(status: SpeechStatus) -> SpeechStatusMsg:
    """Write what the recogniser is doing."""
    return SpeechStatusMsg(
        header=header_to_msg(status.examined_until_s, ""),
        state=int(status.state),
        rejected=status.rejected,
        last_rejection=status.last_rejection,
    )


def speech_status_from_msg(msg: SpeechStatusMsg) -> SpeechStatus:
    """Read what the recogniser is doing."""
    return SpeechStatus(
        seconds_from_msg(msg.header.stamp), SpeechState(msg.state), int(msg.rejected), msg.last_rejection
    )


def vocabulary_to_msg(words: Mapping[str, str], stamp_s: float) -> VocabularyMsg:
    """Write words with their pronunciations (ARPAbet; empty: by the spelling)."""
    return VocabularyMsg(
        header=header_to_msg(stamp_s, ""), words=list(words), pronunciations=[words[word] for word in words]
    )


def vocabulary_from_msg(msg: VocabularyMsg) -> dict[str, str]:
    """Read words with their pronunciations.

    Raises:
        LexiconError: there are pronunciations, but not one for each word.
    """
    words, phones = list(msg.words), list(msg.pronunciations)
    if phones and len(phones) != len(words):
        raise LexiconError(f"{len(words)} words came with {len(phones)} pronunciations; give one each, or none")
    return dict(zip(words, phones or [""] * len(words), strict=True))
