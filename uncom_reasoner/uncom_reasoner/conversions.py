# SPDX-License-Identifier: Apache-2.0
"""Decisions to messages and back, in pairs."""

from __future__ import annotations

import json
from typing import Any

from std_msgs.msg import Header
from uncom_common.conversions import (
    duration_to_msg,
    header_to_msg,
    matrix_from_pose_msg,
    pose_to_msg,
    primitive_from_msg,
    primitive_to_msg,
    seconds_from_msg,
    time_to_msg,
)
from uncom_perception.conversions import (
    detection_from_msg,
    detection_to_msg,
    polygon_from_msg,
    polygon_to_msg,
    table_from_msg,
    table_to_msg,
)
from uncom_perception.types import Box

from uncom_interfaces.msg import Answer as AnswerMsg
from uncom_interfaces.msg import Candidate as CandidateMsg
from uncom_interfaces.msg import Explanation as ExplanationMsg
from uncom_interfaces.msg import GroundedCommand as GroundedCommandMsg
from uncom_interfaces.msg import GroundedTarget as GroundedTargetMsg
from uncom_interfaces.msg import Question as QuestionMsg
from uncom_reasoner.dialogue.types import Answer, Question, QuestionKind, Verdict
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.types import Candidate, Factor, GroundedCommand, GroundedTarget, Status, TargetKind


def candidate_to_msg(candidate: Candidate) -> CandidateMsg:
    """Write a candidate; one without a box has zeros."""
    box = candidate.box or Box(0.0, 0.0, 0.0, 0.0)
    return CandidateMsg(
        id=candidate.id,
        label=candidate.label,
        x_min=float(box.x_min),
        y_min=float(box.y_min),
        x_max=float(box.x_max),
        y_max=float(box.y_max),
        factor_names=[factor.name for factor in candidate.factors],
        factor_logs=[float(factor.log) for factor in candidate.factors],
        probability=float(candidate.probability),
        chosen=candidate.chosen,
    )


def candidate_from_msg(msg: CandidateMsg) -> Candidate:
    """Read a candidate."""
    box = Box(msg.x_min, msg.y_min, msg.x_max, msg.y_max)
    factors = tuple(Factor(n, float(v)) for n, v in zip(msg.factor_names, msg.factor_logs, strict=True))
    nowhere = box == Box(0.0, 0.0, 0.0, 0.0)
    return Candidate(msg.id, msg.label, factors, float(msg.probability), None if nowhere else box, bool(msg.chosen))


def target_to_msg(target: GroundedTarget, header: Header) -> GroundedTargetMsg:
    """Write a target; an unknown pose has an orientation of zeros."""
    msg = GroundedTargetMsg(kind=int(target.kind), area=polygon_to_msg(target.area))
    msg.pose.orientation.w = 0.0
    if target.pose is not None:
        msg.pose = pose_to_msg(target.pose)
    if target.detection is not None:
        msg.object = detection_to_msg(target.detection, header)
    return msg


def target_from_msg(msg: GroundedTargetMsg) -> GroundedTarget:
    """Read a target."""
    q = msg.pose.orientation
    known = any((q.x, q.y, q.z, q.w))
    kind = _enum(TargetKind, msg.kind)
    return GroundedTarget(
        kind=kind,
        detection=detection_from_msg(msg.object) if kind is TargetKind.OBJECT else None,
        pose=matrix_from_pose_msg(msg.pose) if known else None,
        area=polygon_from_msg(msg.area),
    )


def grounded_command_to_msg(grounded: GroundedCommand) -> GroundedCommandMsg:
    """Write a grounded command."""
    header = header_to_msg(grounded.stamp_s, grounded.frame_id)
    msg = GroundedCommandMsg(
        header=header,
        utterance_id=grounded.utterance_id,
        index=grounded.index,
        status=int(grounded.status),
        reason=grounded.reason,
        object_text=grounded.object_text,
        action_text=grounded.action_text,
        target_text=grounded.target_text,
        primitive=primitive_to_msg(grounded.primitive),
        relation=grounded.relation,
        object_probability=float(grounded.object_probability),
        target=target_to_msg(grounded.target, header),
        target_probability=float(grounded.target_probability),
        scene=[detection_to_msg(d, header) for d in grounded.scene],
        object_candidates=[candidate_to_msg(c) for c in grounded.object_candidates],
        target_candidates=[candidate_to_msg(c) for c in grounded.target_candidates],
        object_frame_stamp=time_to_msg(grounded.object_frame_s),
        target_frame_stamp=time_to_msg(grounded.target_frame_s),
        backends=list(grounded.backends),
        latency_s=float(grounded.latency_s),
        part=grounded.part,
        parts=grounded.parts,
    )
    if grounded.object is not None:
        msg.object = detection_to_msg(grounded.object, header)
    msg.table = table_to_msg(grounded.table)
    return msg


def grounded_command_from_msg(msg: GroundedCommandMsg) -> GroundedCommand:
    """Read a grounded command.

    Raises:
        InvalidGroundingError: status or kind of target is not one of the constants.
        UnknownPrimitiveError: the primitive is not one of the constants.
    """
    return GroundedCommand(
        stamp_s=seconds_from_msg(msg.header.stamp),
        frame_id=msg.header.frame_id,
        utterance_id=msg.utterance_id,
        index=int(msg.index),
        status=_enum(Status, msg.status),
        reason=msg.reason,
        object_text=msg.object_text,
        action_text=msg.action_text,
        target_text=msg.target_text,
        primitive=primitive_from_msg(msg.primitive),
        relation=msg.relation,
        object=detection_from_msg(msg.object) if msg.object.id else None,
        object_probability=float(msg.object_probability),
        target=target_from_msg(msg.target),
        target_probability=float(msg.target_probability),
        scene=tuple(detection_from_msg(d) for d in msg.scene),
        table=table_from_msg(msg.table),
        object_candidates=tuple(candidate_from_msg(c) for c in msg.object_candidates),
        target_candidates=tuple(candidate_from_msg(c) for c in msg.target_candidates),
        object_frame_s=seconds_from_msg(msg.object_frame_stamp),
        target_frame_s=seconds_from_msg(msg.target_frame_stamp),
        backends=tuple(msg.backends),
        latency_s=float(msg.latency_s),
        part=int(msg.part),
        parts=max(1, int(msg.parts)),
    )


def explanation_to_msg(explanation: dict[str, Any], header: Header) -> ExplanationMsg:
    """Write an explanation (the object of explanation.py)."""
    return ExplanationMsg(
        header=header,
        utterance_id=str(explanation["utterance_id"]),
        index=int(explanation["index"]),
        json=json.dumps(explanation),
    )


def explanation_from_msg(msg: ExplanationMsg) -> dict[str, Any]:
    """Read an explanation."""
    found = json.loads(msg.json)
    if not isinstance(found, dict):
        raise InvalidGroundingError("an explanation must be a JSON object")
    return found


def question_to_msg(question: Question, header: Header) -> QuestionMsg:
    """Write a question."""
    return QuestionMsg(
        header=header,
        question_id=question.id,
        utterance_id=question.utterance_id,
        kind=int(question.kind),
        text=question.text,
        choices=list(question.choices),
        candidate_ids=list(question.candidate_ids),
        timeout=duration_to_msg(question.timeout_s),
    )


def question_from_msg(msg: QuestionMsg) -> Question:
    """Read a question."""
    return Question(
        id=msg.question_id,
        utterance_id=msg.utterance_id,
        kind=_enum(QuestionKind, msg.kind),
        text=msg.text,
        choices=tuple(msg.choices),
        candidate_ids=tuple(msg.candidate_ids),
        timeout_s=seconds_from_msg(msg.timeout),
    )


def answer_to_msg(answer: Answer, header: Header) -> AnswerMsg:
    """Write an answer."""
    return AnswerMsg(
        header=header,
        question_id=answer.question_id,
        answer=int(answer.verdict),
        choice=answer.choice,
        text=answer.text,
    )


def answer_from_msg(msg: AnswerMsg) -> Answer:
    """Read an answer; what is not one of the constants is unknown, and never a yes."""
    known = msg.answer in {int(v) for v in Verdict}
    return Answer(msg.question_id, Verdict(msg.answer) if known else Verdict.UNKNOWN, int(msg.choice), msg.text)


def _enum(kind: Any, value: int) -> Any:
    try:
        return kind(value)
    except ValueError as error:
        valid = ", ".join(f"{member.value} {member.name}" for member in kind)
        raise InvalidGroundingError(f"{kind.__name__} {value} is not one of {valid}") from error
