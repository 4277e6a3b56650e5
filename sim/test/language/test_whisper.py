# SPDX-License-Identifier: Apache-2.0
"""Whisper: loading, a tiny model with random weights end to end, and the times of its words."""

from __future__ import annotations

import json

import numpy as np
import pytest
from simulated_speech import say
from uncom_common.exceptions import ModelNotFoundError
from uncom_language.speech.recognition.recognizer import Recognition
from uncom_language.speech.recognizer_factory import make_recognizer
from uncom_language.speech.whisper.options import WhisperOptions
from uncom_language.speech.whisper.whisper_recognizer import WhisperRecognizer, words_of_chunks

RATE = 16000


@pytest.fixture(scope="module")
def tiny_whisper(tmp_path_factory):
    """Save a multilingual Whisper of few random weights with a byte-level tokenizer."""
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    tokenizers = pytest.importorskip("tokenizers")
    alphabet = sorted(tokenizers.pre_tokenizers.ByteLevel.alphabet())
    names = ["<|endoftext|>", "<|startoftranscript|>", "<|en|>", "<|de|>", "<|translate|>", "<|transcribe|>"]
    names += ["<|startoflm|>", "<|startofprev|>", "<|nospeech|>", "<|notimestamps|>"]
    names += [f"<|{step * 0.02:.2f}|>" for step in range(1501)]
    folder = tmp_path_factory.mktemp("tiny_whisper")
    (folder / "vocab.json").write_text(json.dumps({symbol: i for i, symbol in enumerate(alphabet)}))
    (folder / "merges.txt").write_text("#version: 0.2\n")
    tokenizer = transformers.WhisperTokenizer(
        vocab=str(folder / "vocab.json"), merges=str(folder / "merges.txt"), unk_token="<|endoftext|>"
    )
    tokenizer.add_special_tokens({"additional_special_tokens": names[:10]})
    tokenizer.add_tokens([tokenizers.AddedToken(name, special=False) for name in names[10:]])
    ids = {name: tokenizer.convert_tokens_to_ids(name) for name in names}
    extractor = transformers.WhisperFeatureExtractor(feature_size=80)
    transformers.WhisperProcessor(extractor, tokenizer).save_pretrained(folder)
    torch.manual_seed(3)
    end = ids["<|endoftext|>"]
    config = transformers.WhisperConfig(
        vocab_size=len(tokenizer),
        d_model=32,
        encoder_layers=2,
        decoder_layers=2,
        encoder_attention_heads=2,
        decoder_attention_heads=2,
        encoder_ffn_dim=64,
        decoder_ffn_dim=64,
        num_mel_bins=80,
        max_target_positions=64,
        decoder_start_token_id=ids["<|startoftranscript|>"],
        eos_token_id=end,
        pad_token_id=end,
        bos_token_id=end,
        begin_suppress_tokens=None,
        suppress_tokens=None,
    )
    model = transformers.WhisperForConditionalGeneration(config)
    known = {
        "is_multilingual": True,
        "lang_to_id": {"<|en|>": ids["<|en|>"], "<|de|>": ids["<|de|>"]},
        "task_to_id": {"translate": ids["<|translate|>"], "transcribe": ids["<|transcribe|>"]},
        "no_timestamps_token_id": ids["<|notimestamps|>"],
        "alignment_heads": [[0, 0], [1, 1]],
        "max_length": 40,
        "decoder_start_token_id": ids["<|startoftranscript|>"],
        "eos_token_id": end,
        "pad_token_id": end,
        "prev_sot_token_id": ids["<|startofprev|>"],
    }
    model.save_pretrained(folder)
    (folder / "generation_config.json").write_text(json.dumps(known))
    return folder


@pytest.mark.parametrize("language", ["en", pytest.param("de", marks=pytest.mark.slow)])
def test_a_model_with_random_weights_runs_from_a_folder_to_timed_words(tiny_whisper, language):
    recognizer = WhisperRecognizer(str(tiny_whisper), language, device="cpu", options=WhisperOptions(hypotheses=2))
    sound = say("take the lemon", snr_db=30).samples
    heard = recognizer.transcribe(sound, RATE)
    assert isinstance(heard, Recognition)
    assert heard.words or heard.reason
    assert all(0.0 <= word.start_s < word.end_s <= len(sound) / RATE + 0.03 for word in heard.words)
    assert (recognizer.language, str(tiny_whisper) in recognizer.backend) == (language, True)


@pytest.mark.slow
def test_long_sound_goes_in_chunks(tiny_whisper):
    recognizer = WhisperRecognizer(str(tiny_whisper), device="cpu", options=WhisperOptions(hypotheses=1))
    sound = np.tile(say("take the lemon", snr_db=30).samples, 14)
    assert len(sound) > 32 * RATE
    heard = recognizer.transcribe(sound, RATE)
    assert heard.words or heard.reason


def test_silence_is_not_given_to_the_model(tiny_whisper):
    recognizer = make_recognizer("whisper", "en", model=str(tiny_whisper))
    assert recognizer.transcribe(np.zeros(RATE, np.int16), RATE).reason == "silence"
    assert make_recognizer("whisper", "en", model=str(tiny_whisper)) is recognizer


def test_a_word_starts_where_it_starts_and_not_where_it_ends():
    chunks = [
        {"text": " Take", "timestamp": (0.5, 0.8)},
        {"text": " the", "timestamp": (0.8, 0.9)},
        {"text": " lemon.", "timestamp": (0.9, None)},
        {"text": " ...", "timestamp": (1.2, 1.3)},
    ]
    words = words_of_chunks(chunks, 1.4)
    assert [(word.text, word.start_s, word.end_s) for word in words] == [
        ("take", 0.5, 0.8),
        ("the", 0.8, 0.9),
        ("lemon", 0.9, 1.4),
    ]


def test_broken_times_become_times_in_order_within_the_sound():
    chunks = [
        {"text": "a", "timestamp": (0.5, 0.5)},
        {"text": "b", "timestamp": (None, 0.2)},
        {"text": "c", "timestamp": (9.0, 9.5)},
    ]
    words = words_of_chunks(chunks, 2.0)
    assert [word.start_s for word in words] == [0.5, 0.5, 2.0]
    assert all(word.end_s > word.start_s for word in words)


def test_weights_that_are_nowhere_are_a_one_line_error(tmp_path):
    pytest.importorskip("transformers")
    with pytest.raises(ModelNotFoundError, match="no usable weights") as caught:
        WhisperRecognizer(str(tmp_path / "none"))
    assert "\n" not in str(caught.value)
