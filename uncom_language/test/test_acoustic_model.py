# SPDX-License-Identifier: Apache-2.0
"""Files of the acoustic model: read, written, adapted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from uncom_language.exceptions import RecognizerError
from uncom_language.speech.pocketsphinx.acoustic_model import (
    WEIGHT_STEP,
    Adaptation,
    make_adapted_model,
    read_adaptation,
    read_gaussians,
    read_weights,
    write_adaptation,
    write_weights,
)
from uncom_language.speech.pocketsphinx.pocketsphinx_recognizer import model_folder

MODEL = model_folder() / "en-us"


def adaptation(seed=3):
    rng = np.random.default_rng(seed)
    shape = read_gaussians(MODEL / "means").values.shape
    streams, densities, _ = read_weights(MODEL / "sendump").values.shape
    shift, spread = (rng.normal(0.0, 0.1, shape).astype(np.float32) for _ in range(2))
    return Adaptation(shift, spread, np.array([5, 700]), rng.integers(0, 150, (streams, densities, 2), dtype=np.uint8))


def test_mixture_weights_of_every_state_add_up_to_about_one():
    sums = np.exp(-WEIGHT_STEP * read_weights(MODEL / "sendump").values.astype(float)).sum(axis=1)
    assert np.all(np.abs(sums - 1.0) < 0.15)


def test_mixture_weights_are_written_as_they_were_read(tmp_path):
    write_weights(read_weights(MODEL / "sendump"), tmp_path / "sendump")
    assert (tmp_path / "sendump").read_bytes() == (MODEL / "sendump").read_bytes()


def test_a_file_that_holds_no_weights_is_a_clear_error(tmp_path):
    (tmp_path / "sendump").write_bytes(b"nothing of the kind")
    with pytest.raises(RecognizerError, match="no mixture weights"):
        read_weights(tmp_path / "sendump")


def test_an_adaptation_is_read_as_it_was_written(tmp_path):
    made = adaptation()
    write_adaptation(made, tmp_path / "made.npz")
    found = read_adaptation(tmp_path / "made.npz")
    assert np.abs(found.shift - made.shift).max() < 0.01
    assert np.abs(found.spread - made.spread).max() < 0.01
    assert np.array_equal(found.states, made.states)
    assert np.array_equal(found.weights, made.weights)


def test_an_adapted_model_differs_where_it_was_adapted(tmp_path):
    made = adaptation()
    folder = make_adapted_model(MODEL, made, tmp_path)
    old, new = read_gaussians(MODEL / "means").values, read_gaussians(folder / "means").values
    assert np.allclose(new - old, made.shift, atol=1e-4)
    changed = np.any(read_weights(MODEL / "sendump").values != read_weights(folder / "sendump").values, axis=(0, 1))
    assert set(np.flatnonzero(changed)) == {5, 700}


def test_an_adaptation_of_another_model_is_refused(tmp_path):
    with pytest.raises(RecognizerError, match="another acoustic model"):
        make_adapted_model(MODEL, replace(adaptation(), shift=np.zeros((1, 3, 128, 13), np.float32)), tmp_path)
