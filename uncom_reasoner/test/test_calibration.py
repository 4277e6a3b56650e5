# SPDX-License-Identifier: Apache-2.0
"""Probabilities that can be trusted, and weights that come from data."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reasoner_scenes import Thing, command, evidence, reference
from uncom_reasoner.calibration.calibration import Table, build_table, calibration_error, reliability, scene_without
from uncom_reasoner.calibration.fit_weights import accept, choose_thresholds, fit, main, read_tables, reweigh
from uncom_reasoner.exceptions import InvalidWeightsError
from uncom_reasoner.grounding.ground import ground
from uncom_reasoner.weights import load_weights


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.booleans()), min_size=1, max_size=200))
def test_every_choice_is_in_one_bin_and_the_error_is_a_share(choices):
    bins = reliability([p for p, _ in choices], [r for _, r in choices])
    assert sum(one.count for one in bins) == len(choices)
    assert all(one.low - 1e-9 <= one.probability <= one.high + 1e-9 for one in bins)
    assert 0.0 <= calibration_error(bins) <= 1.0


def test_probabilities_that_are_frequencies_have_no_calibration_error():
    rng = np.random.default_rng(3)
    p = rng.uniform(0.0, 1.0, 40_000)
    assert calibration_error(reliability(p, rng.uniform(size=len(p)) < p)) < 0.02
    assert calibration_error(reliability(np.full(100, 0.95), [False] * 100)) == pytest.approx(0.95)


LEMONS = [Thing("lemon_1", "lemon", 0.6, 0.2), Thing("bowl_1", "bowl", 0.6, -0.2), Thing("mug_1", "mug", 0.7, 0.0)]


def test_a_scene_without_a_thing_is_one_where_it_is_not_seen():
    """The scores are those of a detector that never saw it: what is left fits no better, and "none" is likelier."""
    cmd = command(reference("lemon", 0, 1))
    made = evidence(cmd, LEMONS)
    assert ground(made).grounded.object.id == "lemon_1"
    gone = dataclasses.replace(made, scene=scene_without(made.scene, "lemon_1"))
    assert len(gone.scene.detections) == 2
    assert ground(gone).grounded.object is None
    for k in range(len(made.phrases)):
        total = sum(d.phrase_scores[k] for d in gone.scene.detections) + gone.scene.phrase_none[k]
        assert total == pytest.approx(1.0, abs=1e-6)


def tables(rng, count=120, ray_helps=True):
    """Choices between two things and none, in which gestures tell more than words do, or nothing at all."""
    made = []
    for _ in range(count):
        truth = rng.integers(2)
        words = rng.normal(0.0, 1.0, 2)
        ray = np.where(np.arange(2) == truth, 1.0, -1.0) if ray_helps else rng.normal(0.0, 1.0, 2)
        rows = tuple((f"d{i}", {"words": float(words[i] - 1.0), "ray": float(ray[i])}) for i in range(2))
        made.append(Table("object", (*rows, ("none", {"words": -3.0, "discount": 0.0})), f"d{truth}"))
    return made


def test_a_factor_that_tells_the_truth_gains_weight_and_noise_loses_it():
    start = load_weights()
    good = fit(tables(np.random.default_rng(0)), start)
    bad = fit(tables(np.random.default_rng(0), ray_helps=False), start)
    assert good.ray > start.ray > bad.ray
    assert good.phrase < start.phrase


def test_fitted_weights_fit_the_tables_better():
    start = load_weights()
    made = tables(np.random.default_rng(1))
    after = fit(made, start)

    def loss(weights):
        return -sum(np.log(reweigh(t, weights, start)[t.truth]) for t in made)

    assert loss(after) < loss(start)


def test_thresholds_keep_wrong_choices_rare():
    start = load_weights()
    rng = np.random.default_rng(2)
    made = []
    for _ in range(200):
        lean = rng.uniform(0.2, 7.0)
        right = rng.uniform() < 1.0 / (1.0 + np.exp(-lean))
        rows = (("a", {"words": lean}), ("b", {"words": 0.0}), ("none", {"words": -9.0}))
        made.append(Table("object", rows, "a" if right else "b"))
    weights = choose_thresholds(made, start, start)
    taken = [accept(t, weights, start)[0] == t.truth for t in made if accept(t, weights, start)[0]]
    assert len(taken) > 20
    assert taken.count(False) <= 0.05 * len(taken)
    assert weights.min_probability > 0.7


def test_the_command_reads_takes_and_writes_weights_that_load(tmp_path):
    cmd = command(reference("lemon", 0, 1))
    g = ground(evidence(cmd, LEMONS)).grounded
    rows = [build_table("object", g.object_candidates, "lemon_1").as_dict()] * 5
    takes = tmp_path / "takes.jsonl"
    takes.write_text(json.dumps({"take": "s01", "notes": {"tables": rows}}) + "\n\n")
    assert [t.truth for t in read_tables([takes])] == ["lemon_1"] * 5
    out = tmp_path / "weights.yaml"
    assert main([str(takes), "--out", str(out)]) == 0
    assert load_weights(out).stray_named == load_weights().stray_named
    assert "#" in out.read_text()  # the remarks stay


def test_bad_input_is_one_line_and_no_weights(tmp_path):
    takes = tmp_path / "takes.jsonl"
    takes.write_text("{not json\n")
    with pytest.raises(InvalidWeightsError, match="cannot read tables"):
        read_tables([takes])
    takes.write_text("{}\n")
    assert main([str(takes), "--out", str(tmp_path / "w.yaml")]) == 2
    assert not (tmp_path / "w.yaml").exists()
