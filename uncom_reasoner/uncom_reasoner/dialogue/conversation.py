# SPDX-License-Identifier: Apache-2.0
"""Deciding in turns: what was decided, asked and amended. No ROS; time is passed in.

A command is decided from its evidence. If that leaves a doubt, a question is asked, and its answer is taken into the
same evidence; other words for the part ("the red one", "this one" with a gesture) make a new command that is looked at
again. A question ends by itself without any effect.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from uncom_language.types import Act, Command, Reference, Relation, Span

from uncom_reasoner.config import PlacingConfig, ReasonerConfig
from uncom_reasoner.detector_phrases import is_bare
from uncom_reasoner.dialogue.dialogue_state import Dialogue
from uncom_reasoner.dialogue.discourse import amend_command, given_after_correction
from uncom_reasoner.dialogue.options import CONVERSATION, ConversationOptions
from uncom_reasoner.dialogue.questions import formulate_question
from uncom_reasoner.dialogue.types import End, Ending, Question
from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.grounding.decision import failed_command
from uncom_reasoner.grounding.ground import ground_parts
from uncom_reasoner.pointing.ray_fusion import assign_dwells, segment_dwells
from uncom_reasoner.posterior.context import Context, build_context
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory, remember
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.posterior.posterior import NONE
from uncom_reasoner.types import Decision, Evidence, Given, Status
from uncom_reasoner.weights import Weights

NO_ANSWER = "I got no answer, so I leave everything as it is."
DENIED = "Then I leave everything as it is."
STOPPED = "Stopped. I leave everything as it is."
DROPPED = "I leave that and take the new command."
GAVE_UP = "I still do not know what you mean, so I leave everything as it is."


@dataclass(frozen=True)
class Turn:
    """A command with its evidence and what was decided; a group has several decisions.

    Attributes:
        evidence: that it was decided on.
        decisions: one, or one for each object of a group.
        question: that was asked about it, if one was.
        questions_asked: about this command so far, with that one.
    """

    evidence: Evidence
    decisions: tuple[Decision, ...]
    question: Question | None = None
    questions_asked: int = 0

    @property
    def command(self) -> Command:
        """The command that was decided on."""
        return self.evidence.command


@dataclass(frozen=True)
class AmendedCommand:
    """A command to be looked at (again).

    Attributes:
        command: with what was said since in the place of what it amends.
        given: what stays settled.
        questions_asked: about it so far.
        replaces: a command that was decided on and now is not to be done.
    """

    command: Command
    given: Given = field(default_factory=Given)
    questions_asked: int = 0
    replaces: Command | None = None


class Conversation:
    """What was said before, the open question, and the last command."""

    def __init__(
        self,
        weights: Weights,
        placing: PlacingConfig,
        question_timeout_s: float = ReasonerConfig.question_timeout_s,
        options: ConversationOptions = CONVERSATION,
    ) -> None:
        """Start without a past.

        Args:
            weights: of the posterior.
            placing: how places are chosen.
            question_timeout_s: how long a question stays open [s].
            options: how often is asked, and when a hand answers.
        """
        self.memory = DiscourseMemory()
        self.dialogue = Dialogue(options)
        self.last: Turn | None = None
        self._before = DiscourseMemory()  # as it was when the last command was decided: a correction starts from there
        self._weights = weights
        self._placing = placing
        self._timeout_s = question_timeout_s
        self._options = options

    def decide(self, evidence: Evidence, now_s: float, questions_asked: int = 0) -> Turn:
        """Decide on a command; a turn with a question waits for its answer (`conclude`).

        Args:
            evidence: that it is decided on.
            now_s: time on the clock of the questions' time-outs [s].
            questions_asked: about this command so far.
        """
        decisions = ground_parts(evidence, self._weights, self._placing, self.memory)
        first = decisions[0]
        if first.grounded.status is Status.AMBIGUOUS:
            question = formulate_question(first, self._context(evidence, first), self._timeout_s)
            if question is not None and questions_asked < self._options.max_questions:
                question = replace(question, id=f"{question.id}-{questions_asked}")
                told = replace(first, grounded=replace(first.grounded, reason=question.text))
                turn = Turn(evidence, (told,), question, questions_asked + 1)
                self.dialogue.ask(question, now_s)
                self.last = turn
                return turn
            why = GAVE_UP if questions_asked else first.grounded.reason
            decisions = (replace(first, grounded=replace(first.grounded, status=Status.FAILED, reason=why)),)
        turn = Turn(evidence, decisions, None, questions_asked)
        if decisions[0].grounded.status is Status.GROUNDED:
            self._before = self.memory
            for decision in decisions:
                self.memory = remember(self.memory, evidence.command, decision.grounded)
            self.last = turn
        return turn

    def conclude(self, ending: Ending, now_s: float) -> Turn | AmendedCommand | None:
        """Take the end of a question about an object or place.

        Args:
            ending: of the question.
            now_s: time on the clock of the questions' time-outs [s].

        Returns:
            The turn with the answer taken in (which may hold the next question), a turn that is cancelled, the amended
            command to be looked at, or None if the question was of no turn.
        """
        turn = self.last
        if turn is None or turn.question is None or turn.question.id != ending.question.id:
            return None
        part, ids = ending.question.part, ending.question.candidate_ids
        if ending.end is End.CHOSEN:
            settled = _settle_part(turn.evidence, part, ending.candidate_id)
            return self.decide(settled, now_s, turn.questions_asked)
        if ending.end is End.REWORDED and ending.command is not None:
            return self._reword(turn, ending.command, part)
        if ending.end is End.DENIED and len(ids) == 1 and part != "perspective":
            return self.decide(_exclude_from_part(turn.evidence, part, ids), now_s, turn.questions_asked)
        reasons = {End.TIMED_OUT: NO_ANSWER, End.DENIED: DENIED, End.STOPPED: STOPPED, End.DROPPED: DROPPED}
        return self._cancel(turn, reasons.get(ending.end, NO_ANSWER))

    def correct(self, said: Command) -> AmendedCommand | None:
        """Amend the last command with a correction ("no, the green one", "a bit to the left"); None without one."""
        turn = self.last
        if turn is None or turn.question is not None or said.act is not Act.CORRECTION:
            return None
        changed = amend_command(turn.command, said)
        self.memory = self._before if said.relation is Relation.NONE or said.target is not None else self.memory
        given = given_after_correction(turn.decisions[-1], said, changed, turn.command)
        return AmendedCommand(changed, given, replaces=turn.command)

    def pointing_answer(self, rays: tuple[RayObservation, ...], asked_s: float, now_s: float) -> Ending | None:
        """End the open question if a hand has come to rest on one of its choices since it was asked.

        The times [s] are of the clock of the rays' stamps.
        """
        turn, question = self.last, self.dialogue.question
        if turn is None or question is None or turn.question is None or turn.question.id != question.id:
            return None
        if question.part == "perspective":
            return None
        since_s = asked_s + self._options.reaction_s
        dwells = [d for d in segment_dwells(rays, self._weights) if d.stamps_s[0] >= since_s]
        ray = assign_dwells(question.part, Span(since_s, now_s), dwells, self._weights)
        if not ray.present or ray.weight < self._options.pointed_weight:
            return None
        if not question.candidate_ids:
            here = Reference("here", "here", Span(since_s, now_s), concrete=False, deictic="here")
            return self.dialogue.heard(Command("", Act.FRAGMENT, "here", target=here, relation=Relation.HERE))
        evidence = replace(
            turn.evidence, given=_restrict_part(turn.evidence.given, question.part, question.candidate_ids)
        )
        context = self._context(evidence, turn.decisions[0])
        this = Reference("this", "this", Span(since_s, now_s), concrete=False, deictic="this")
        found = [c for c in weigh_candidates(Query(this, ray, use_words=False), context) if c.id != NONE]
        if not found or found[0].probability < self._options.pointed_probability:
            return None
        return self.dialogue.pointed(found[0].id)

    def drop_question(self) -> None:
        """Drop the open question without a word (the session was stopped)."""
        self.dialogue.close()
        if self.last is not None and self.last.question is not None:
            self.last = None

    def _context(self, evidence: Evidence, decision: Decision) -> Context:
        placing = replace(self._placing, perspective=decision.perspective or self._placing.perspective)
        return build_context(evidence, self._weights, placing, self.memory)

    def _reword(self, turn: Turn, said: Command, part: str) -> AmendedCommand:
        changed = amend_command(turn.command, said, part)
        # The index is that of the command which was asked about, so that its answer is known as the same command's.
        old = turn.command
        changed = replace(changed, utterance_id=old.utterance_id, index=old.index, count=old.count)
        given, question = turn.evidence.given, turn.question
        fragment = said.object or said.target
        if question is not None and fragment is not None and is_bare(fragment):
            given = _restrict_part(given, part, question.candidate_ids)
        return AmendedCommand(changed, given, turn.questions_asked)

    def _cancel(self, turn: Turn, reason: str) -> Turn:
        self.last = None
        command = turn.command
        grounded = replace(failed_command(command, reason), status=Status.CANCELLED)
        return Turn(turn.evidence, (Decision(grounded),), None, turn.questions_asked)


def _restrict_part(given: Given, part: str, ids: tuple[str, ...]) -> Given:
    return replace(given, among={**given.among, part: frozenset(ids)})


def _settle_part(evidence: Evidence, part: str, candidate_id: str) -> Evidence:
    if part == "perspective":
        return replace(evidence, given=replace(evidence.given, perspective=candidate_id))
    return replace(evidence, given=_restrict_part(evidence.given, part, (candidate_id,)))


def _exclude_from_part(evidence: Evidence, part: str, ids: tuple[str, ...]) -> Evidence:
    given = evidence.given
    excluded = given.excluded.get(part, frozenset()) | frozenset(ids)
    among = {name: kept - excluded if name == part else kept for name, kept in given.among.items()}
    return replace(evidence, given=replace(given, excluded={**given.excluded, part: excluded}, among=among))
