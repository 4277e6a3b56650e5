# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune recognition with PocketSphinx."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class LanguageModelOptions:
    """How much of each level of n-grams goes to the one below, and how the single words are mixed."""

    trigram_backoff: float = tunable(0.05, meaning="share of trigrams that goes to bigrams")
    bigram_backoff: float = tunable(0.1, meaning="share of bigrams that goes to single words")
    general_share: float = tunable(0.1, meaning="share of single words for common English words outside the patterns")
    scene_share: float = tunable(0.05, meaning="share of single words for words that the scene offers")
    sentences: int = tunable(30000, meaning="sentences that are drawn from the patterns and counted")
    seed: int = tunable(1, meaning="seed of the draw")
    max_depth: int = tunable(12, meaning="nesting of patterns from which on the first option is taken")


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """Numbers of the decoder's search; see `pocketsphinx_batch -help`."""

    language_weight: float = tunable(9.0, meaning="weight of the language model (lw)")
    word_insertion_penalty: float = tunable(0.65, meaning="factor on the probability of each word (wip)")
    general_words: int = tunable(2000, meaning="common English words in the vocabulary beside those of the patterns")
    max_active: int = tunable(3000, meaning="states that stay in the search per frame (maxhmmpf)")
    # For people the beams stay as PocketSphinx has them, which is narrower: their sound fits worse, so more states
    # would compete for max_active.
    beam: float = tunable(1e-60, meaning="synthesised voices: how unlikely a state may be beside the best one")
    phone_beam: float = tunable(1e-60, meaning="the same for the end of a phone (pbeam)")
    word_beam: float = tunable(1e-40, meaning="the same for the end of a word (wbeam)")
    last_phone_beam: float = tunable(1e-60, meaning="the same for the last phone of a word (lpbeam)")
    only_phone_beam: float = tunable(1e-40, meaning="the same for the last phone of a word's end (lponlybeam)")
    alternatives: int = tunable(8, meaning="alternatives that are returned at most")
    hypotheses_per_alternative: int = tunable(
        10, meaning="entries of the n-best list that are read for each alternative"
    )
    new_word_weight: float = tunable(
        20.0, meaning="likelihood of a word learnt at run time, in shares of the mean word of the model"
    )


@dataclass(frozen=True, slots=True)
class DecodingOptions:
    """How an utterance is handed to the decoders."""

    max_utterance_s: float = tunable(30.0, unit="s", meaning="longer sound is decoded in parts")
    block_s: float = tunable(0.05, unit="s", meaning="blocks in which whole utterances are handed over")
    piece_s: float = tunable(0.09, unit="s", meaning="sound that is collected before it is decoded")
    mean_s: float = tunable(
        0.8,
        unit="s",
        meaning="sound after which the cepstral mean is known well enough to begin",
        source="measured: as good as the mean of the whole utterance",
    )
    hopeless_log: float = tunable(
        12.0,
        meaning="log score by which a model must lie behind another to be given up",
        source="measured on people and on synthesised voices: none behind by half of it came to the front",
    )
    cepstral_mean: tuple[float, ...] = tunable(
        (62.8, -7.75, -2.02, 5.14, -4.49, -4.12, -2.62, -7.64, -5.75, -4.24, -0.83, -0.57, -3.45),
        meaning="mean that each utterance starts from, so that none depends on those before it; it weighs as much as "
        "five seconds of sound",
        source="what PocketSphinx had arrived at after twelve sentences in nine voices",
    )
    min_sound_s: float = tunable(0.1, unit="s", meaning="shorter sound holds no word")
    min_level_db: float = tunable(-70.0, unit="dB", meaning="level of full scale below which sound is silence")
    onset_rise_db: float = tunable(6.0, unit="dB", meaning="how far the first sound of a word is above the background")
    onset_background_percentile: float = tunable(10, unit="%", meaning="percentile of the levels that is background")
    onset_lead_frames: int = tunable(3, meaning="frames before the rise at which the first word begins")
    warm_up_s: float = tunable(2.0, unit="s", meaning="noise that new decoders hear first")
    warm_up_block_s: float = tunable(0.1, unit="s", meaning="blocks in which they hear it")
    warm_up_level: float = tunable(300.0, meaning="standard deviation of that noise [steps of 16 bit samples]")


@dataclass(frozen=True, slots=True)
class NoiseFloorOptions:
    """The white noise that is added to sound without background."""

    snr_db: float = tunable(
        32.0,
        unit="dB",
        meaning="the background is at least this far below the speech",
        source="measured: without it every second word of clean synthetic speech is lost",
    )
    frame_s: float = tunable(0.02, unit="s", meaning="length of the frames whose power is measured")
    min_frames: int = tunable(3, meaning="shorter sound gets no noise")
    speech_percentile: float = tunable(60, unit="%", meaning="frames above this percentile of power are speech")
    background_percentile: float = tunable(10, unit="%", meaning="percentile of power that is the background")


LANGUAGE_MODEL = LanguageModelOptions()
SEARCH = SearchOptions()
DECODING = DecodingOptions()
NOISE_FLOOR = NoiseFloorOptions()
