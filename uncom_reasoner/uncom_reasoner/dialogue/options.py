# SPDX-License-Identifier: Apache-2.0
"""Numbers of the dialogue: questions, their choices, and answers by pointing."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ConversationOptions:
    """How often is asked, and when a hand answers. How long a question stays open: `question_timeout_s` of the node."""

    max_questions: int = tunable(3, meaning="questions about one command")
    max_reminders: int = tunable(2, meaning="how often one question is said again when the answer is not understood")
    pointed_probability: float = tunable(0.9, meaning="a gesture answers if one choice is this probable by it")
    pointed_weight: float = tunable(2.0, meaning="and the hand stayed for this many frames' weight")
    reaction_s: float = tunable(
        0.2, unit="s", meaning="a hand that pointed sooner after the question is no answer to it"
    )


@dataclass(frozen=True, slots=True)
class QuestionOptions:
    """How the choices of a question are named."""

    max_choices: int = tunable(3, meaning="with more choices none is listed")
    clear_size_log: float = tunable(0.18, meaning="difference of sizes (log) that a person sees at once")
    clear_side_m: float = tunable(0.08, unit="m", meaning="difference of places that a person sees at once")
    beside_m: float = tunable(0.15, unit="m", meaning='an object this near is a neighbour ("next to the box")')


CONVERSATION = ConversationOptions()
QUESTION = QuestionOptions()
