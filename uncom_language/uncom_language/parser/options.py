# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune how words become commands."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class UnderstandingOptions:
    """Which alternatives of the recogniser are considered."""

    max_alternative_loss: float = tunable(
        6.0, meaning="how much lower the log score of an alternative may be that is taken instead of the best words"
    )


@dataclass(frozen=True, slots=True)
class ParserOptions:
    """How far the grammar parser looks for a sentence in words that are none as they stand."""

    max_retagged: int = tunable(
        8, meaning="other classes of ambiguous words that are tried before a sentence is refused"
    )
    retagged_window: int = tunable(3, meaning="words up to the one that does not fit, whose other classes are tried")
    max_self_repairs: int = tunable(4, meaning="corrections by the speaker within one utterance that are followed")
    max_act_words: int = tunable(4, meaning="words at the end of an utterance among which a dialogue act is looked for")
    max_marker_words: int = tunable(6, meaning="words of the longest phrase that marks a dialogue act or a correction")
    max_amending_words: int = tunable(3, meaning="words of the longest phrase at the end that marks a correction")
    max_repeated_words: int = tunable(3, meaning="words of the longest repetition that is removed")
    max_number_words: int = tunable(2, meaning="words of the longest number, and of what may stand before it")
    max_quantity: int = tunable(255, meaning="largest number of objects", source="uint8 of Reference.msg")


@dataclass(frozen=True, slots=True)
class TypedTextOptions:
    """Word times of text that was typed."""

    word_s: float = tunable(0.4, unit="s", meaning="time from the start of one word to that of the next")
    voiced_share: float = tunable(0.9, meaning="share of that time which the word takes")


@dataclass(frozen=True, slots=True)
class CorrectionOptions:
    """When a noun is taken for another one that it sounds like."""

    sound_share: float = tunable(
        0.65, meaning="share of the sounds (Metaphone) in the similarity of two words; the rest is their spelling"
    )
    # "ball" and "bowl" 0.88, "pair" and "pear" 0.95; but "spoon" and "spool" 0.76, "can" and "pan" 0.60.
    min_similarity: float = tunable(0.78, meaning="least similarity of the word heard and the one meant")
    min_margin: float = tunable(0.08, meaning="how much less similar the second likeliest word must be")


UNDERSTANDING = UnderstandingOptions()
PARSER = ParserOptions()
TYPED_TEXT = TypedTextOptions()
CORRECTION = CorrectionOptions()
