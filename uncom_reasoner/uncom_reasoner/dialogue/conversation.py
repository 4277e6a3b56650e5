# SPDX-License-Identifier: Apache-2.0
"""Deciding in turns: what was decided, asked and amended. No ROS; time is passed in.

A command is decided from its evidence. If that leaves a doubt, a question is asked, and its answer is taken into the
same evidence; other words for the part ("the red one", "this one" with a gesture) make a new command that is looked at
again. A question ends by itself without any effect.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from uncom_language.types import Act, Command, Reference, Relation, Span

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import is_bare
from uncom_reasoner.dialogue.discourse import amended, given_after
from uncom_reasoner.dialogue.machine import Dialogue
from uncom_reasoner.dialogue.questions import question_for
from uncom_reasoner.dialogue.types import End, Ending, Question
from uncom_reasoner.grounding.decision import failed
from uncom_reasoner.grounding.ground import ground_parts
from uncom_reasoner.pointing.ray_fusion import dwells_of, phrase_ray
from uncom_reasoner.posterior.context import Context, context_of
from uncom_reasoner.posterior.discourse_memory import Memory, remember
from uncom_reasoner.posterior.object_likelihood import Query, weigh
from uncom_reasoner.posterior.posterior import NONE
from uncom_reasoner.types import Decision, Evidence, Given, RayObservation, Status
from uncom_reasoner.weights import Weights

MOST_QUESTIONS = 3  # about one command
NO_ANSWER = "I got no answer, so I leave everything as it is."
DENIED = "Then I leave everything as it is."
STOPPED = "Stopped. I leave everything as it is."
DROPPED = "I leave that and take the new command."
GAVE_UP = "I still do not know what you mean, so I leave everything as it is."
POINTED_SHARE = 0.9  # a gesture answers if it is so sure among the choices
POINTED_WEIGHT = 2.0  # and the hand stayed for so many frames' weight
REACTION_S = 0.2  # a hand that pointed before the question is no answer to it


@dataclass(frozen=True)
class Turn:
    """A command with its evidence and what was decided; a group has several decisions."""

    evidence: Evidence
    decisions: tuple[Decision, ...]
    question: Question | None = None
    asked: int = 0

    @property
    def command(self) -> Command:
        """The command."""
        return self.evidence.command


@dataclass(frozen=True)
class Again:
    """A command to be looked at (again): it was amended; `given` is what stays settled."""

    command: Command
    given: Given = field(default_factory=Given)
    asked: int = 0
    replaces: Command | None = None  # a command that was decided and now is not to be done


class Conversation:
    """What was said before, the open question, and the last command."""

    def __init__(self, weights: Weights, placing: PlacingConfig, question_timeout_s: float = 15.0) -> None:
        """Start without a past."""
        self.memory = Memory()
        self.dialogue = Dialogue()
        self.last: Turn | None = None
        self._before = Memory()  # as it was when the last command was decided: a correction starts from there
        self._weights = weights
        self._placing = placing
        self._timeout_s = question_timeout_s

    def decide(self, evidence: Evidence, now_s: float, asked: int = 0) -> Turn:
        """Decide on a command; a turn with a question waits for its answer (`end`)."""
        decisions = ground_parts(evidence, self._weights, self._placing, self.memory)
        first = decisions[0]
        if first.grounded.status is Status.AMBIGUOUS:
            question = question_for(first, self._context(evidence, first), self._timeout_s)
            if question is not None and asked < MOST_QUESTIONS:
                question = replace(question, id=f"{question.id}-{asked}")
                told = replace(first, grounded=replace(first.grounded, reason=question.text))
                turn = Turn(evidence, (told,), question, asked + 1)
                self.dialogue.ask(question, now_s)
                self.last = turn
                return turn
            why = GAVE_UP if asked else first.grounded.reason
            decisions = (replace(first, grounded=replace(first.grounded, status=Status.FAILED, reason=why)),)
        turn = Turn(evidence, decisions, None, asked)
        if decisions[0].grounded.status is Status.GROUNDED:
            self._before = self.memory
            for decision in decisions:
                self.memory = remember(self.memory, evidence.command, decision.grounded)
            self.last = turn
        return turn

    def end(self, ending: Ending, now_s: float) -> Turn | Again | None:
        """Take the end of a question about a thing or place.

        Returns:
            The turn with the answer taken in (which may hold the next question), a turn that is cancelled, the amended
            command to be looked at, or None if the question was of no turn.
        """
        turn = self.last
        if turn is None or turn.question is None or turn.question.id != ending.question.id:
            return None
        part = ending.question.part
        if ending.end is End.CHOSEN:
            return self.decide(_settled(turn.evidence, part, ending.candidate_id), now_s, turn.asked)
        if ending.end is End.REWORDED and ending.command is not None:
            return self._reworded(turn, ending.command, part)
        if ending.end is End.DENIED and len(ending.question.candidate_ids) == 1 and part != "perspective":
            return self.decide(_excluded(turn.evidence, part, ending.question.candidate_ids), now_s, turn.asked)
        reasons = {End.TIMED_OUT: NO_ANSWER, End.DENIED: DENIED, End.STOPPED: STOPPED, End.DROPPED: DROPPED}
        return self._cancelled(turn, reasons.get(ending.end, NO_ANSWER))

    def correct(self, said: Command) -> Again | None:
        """Amend the last command with a correction ("no, the green one", "a bit to the left"); None without one."""
        turn = self.last
        if turn is None or turn.question is not None or said.act is not Act.CORRECTION:
            return None
        changed = amended(turn.command, said)
        self.memory = self._before if said.relation is Relation.NONE or said.target is not None else self.memory
        given = given_after(turn.decisions[-1], said, changed, turn.command)
        return Again(changed, given, replaces=turn.command)

    def pointing_answer(self, rays: tuple[RayObservation, ...], asked_s: float, now_s: float) -> Ending | None:
        """End the open question if a hand has come to rest on one of its choices since it was asked.

        The times [s] are of the clock of the rays' stamps.
        """
        turn, question = self.last, self.dialogue.question
        if turn is None or question is None or turn.question is None or turn.question.id != question.id:
            return None
        if question.part == "perspective":
            return None
        since = asked_s + REACTION_S
        dwells = [d for d in dwells_of(rays, self._weights) if d.stamps_s[0] >= since]
        ray = phrase_ray(question.part, Span(since, now_s), dwells, self._weights)
        if not ray.present or ray.weight < POINTED_WEIGHT:
            return None
        if not question.candidate_ids:
            here = Reference("here", "here", Span(since, now_s), concrete=False, deictic="here")
            return self.dialogue.heard(Command("", Act.FRAGMENT, "here", target=here, relation=Relation.HERE))
        evidence = replace(turn.evidence, given=_among(turn.evidence.given, question.part, question.candidate_ids))
        context = self._context(evidence, turn.decisions[0])
        this = Reference("this", "this", Span(since, now_s), concrete=False, deictic="this")
        found = [c for c in weigh(Query(this, ray, use_words=False), context) if c.id != NONE]
        if not found or found[0].probability < POINTED_SHARE:
            return None
        return self.dialogue.pointed(found[0].id)

    def forget(self) -> None:
        """Drop the open question without a word (the session was stopped)."""
        self.dialogue.close()
        if self.last is not None and self.last.question is not None:
            self.last = None

    def _context(self, evidence: Evidence, decision: Decision) -> Context:
        placing = replace(self._placing, perspective=decision.perspective or self._placing.perspective)
        return context_of(evidence, self._weights, placing, self.memory)

    def _reworded(self, turn: Turn, said: Command, part: str) -> Again:
        changed = amended(turn.command, said, part)
        # The index is that of the command which was asked about, so that its answer is known as the same command's.
        old = turn.command
        changed = replace(changed, utterance_id=old.utterance_id, index=old.index, count=old.count)
        given, question = turn.evidence.given, turn.question
        fragment = said.object or said.target
        if question is not None and fragment is not None and is_bare(fragment):
            given = _among(given, part, question.candidate_ids)
        return Again(changed, given, turn.asked)

    def _cancelled(self, turn: Turn, reason: str) -> Turn:
        self.last = None
        command = turn.command
        grounded = replace(failed(command, reason), status=Status.CANCELLED)
        return Turn(turn.evidence, (Decision(grounded),), None, turn.asked)


def _among(given: Given, part: str, ids: tuple[str, ...]) -> Given:
    return replace(given, among={**given.among, part: frozenset(ids)})


def _settled(evidence: Evidence, part: str, candidate_id: str) -> Evidence:
    if part == "perspective":
        return replace(evidence, given=replace(evidence.given, perspective=candidate_id))
    return replace(evidence, given=_among(evidence.given, part, (candidate_id,)))


def _excluded(evidence: Evidence, part: str, ids: tuple[str, ...]) -> Evidence:
    given = evidence.given
    excluded = given.excluded.get(part, frozenset()) | frozenset(ids)
    among = {name: kept - excluded if name == part else kept for name, kept in given.among.items()}
    return replace(evidence, given=replace(given, excluded={**given.excluded, part: excluded}, among=among))
