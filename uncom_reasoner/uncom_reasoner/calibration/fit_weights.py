# SPDX-License-Identifier: Apache-2.0
"""Weights from takes with a known truth.

Run `python -m uncom_reasoner.calibration.fit_weights takes.jsonl ... --out weights.yaml`.

The input is what `uncom bench understanding --seed N` leaves (takes.jsonl), made with seeds that no reported figure
uses. Fitted are the multipliers of the log factors and how much less likely "none of these" is than it looks, by
penalised maximum likelihood over all tables; then the thresholds, as the lowest that keep wrong choices among the
accepted ones below a share. Spreads of gestures (angles, times) are physical and stay as they are.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from uncom_common.transforms import FloatArray

from uncom_reasoner.calibration.calibration import Table, calibration_error, reliability
from uncom_reasoner.calibration.options import FIT, FitOptions
from uncom_reasoner.exceptions import InvalidWeightsError, ReasonerError
from uncom_reasoner.posterior.posterior import NONE
from uncom_reasoner.weights import DEFAULT_FILE, Weights, load_weights

logger = logging.getLogger(__name__)

# which weight multiplies which factor
FACTORS = {
    "words": "phrase",
    "ray": "ray",
    "relation": "relation",
    "compared": "position",
    "excluded": "position",
    "likeness": "position",
    "discourse": "discourse",
    "plausible": "plausible",
    "rival": "rival",
}
FITTED = tuple(dict.fromkeys(FACTORS.values()))


def fit(tables: Sequence[Table], start: Weights, options: FitOptions = FIT) -> Weights:
    """Return the weights with fitted multipliers and "none".

    Args:
        tables: choices with the truth.
        start: weights that the tables were made with.
        options: of the penalties.

    Raises:
        InvalidWeightsError: there are no tables.
    """
    if not tables:
        raise InvalidWeightsError("there are no tables to fit weights to; run the benchmark with other seeds first")
    present = sum(table.truth != NONE for table in tables)
    absent = max(len(tables) - present, 1)
    share = options.absent_share * max(present, 1) / absent
    shares = np.array([1.0 if table.truth != NONE else share for table in tables])
    found = minimize(_loss, np.zeros(len(FITTED) + 1), (tables, shares, start, options), method="L-BFGS-B")
    return _apply_multipliers(start, found.x)


def _apply_multipliers(start: Weights, x: FloatArray) -> Weights:
    scaled = {name: round(getattr(start, name) * float(np.exp(x[i])), 3) for i, name in enumerate(FITTED)}
    return dataclasses.replace(start, **scaled, none_discount=round(max(start.none_discount + float(x[-1]), 0.0), 3))


def _loss(x: FloatArray, tables: Sequence[Table], shares: FloatArray, start: Weights, options: FitOptions) -> float:
    """Return the penalised negative log likelihood of logarithms of multipliers, the last the change of "none"."""
    weights = dataclasses.replace(
        start,
        **{name: getattr(start, name) * float(np.exp(x[i])) for i, name in enumerate(FITTED)},
        none_discount=max(start.none_discount + float(x[-1]), 0.0),
    )
    losses = [-np.log(max(reweigh(t, weights, start)[t.truth], options.min_likelihood)) for t in tables]
    prior = float(np.sum((x[:-1] / options.prior_sigma) ** 2) + (x[-1] / options.none_sigma) ** 2) / 2.0
    return float(np.dot(shares, losses)) + prior


def reweigh(table: Table, weights: Weights, made_with: Weights) -> Mapping[str, float]:
    """Return the candidates' probabilities with other weights than the table was made with."""
    logs = np.array([_reweighed_log(name, factors, weights, made_with) for name, factors in table.candidates])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    return {name: float(q) for (name, _), q in zip(table.candidates, p, strict=True)}


def _reweighed_log(name: str, factors: Mapping[str, float], weights: Weights, made_with: Weights) -> float:
    total = -(weights.none_discount - made_with.none_discount) if name == NONE else 0.0
    for factor, log in factors.items():
        field = FACTORS.get(factor)
        total += log * (getattr(weights, field) / getattr(made_with, field) if field is not None else 1.0)
    return total


def accept(table: Table, weights: Weights, made_with: Weights) -> tuple[str, float]:
    """Return which object is taken ("" for a question or a refusal) and its share among the objects."""
    p = reweigh(table, weights, made_with)
    objects = sorted(((q, name) for name, q in p.items() if name != NONE), reverse=True)
    total = sum(q for q, _ in objects)
    if not objects or p.get(NONE, 0.0) > total:
        return "", 0.0
    (best, name), *others = objects
    second = others[0][0] if others else 0.0
    share = best / total
    clear = share >= weights.min_probability and best >= weights.min_odds * second
    return (name if clear else ""), share


def choose_thresholds(
    tables: Sequence[Table], weights: Weights, made_with: Weights, options: FitOptions = FIT
) -> Weights:
    """Choose the lowest thresholds at which few enough of the accepted choices are wrong (with one to spare)."""
    for share in np.linspace(options.min_threshold, options.max_threshold, options.threshold_steps):
        odds = max(options.least_odds, round(share / (1.0 - share) / options.odds_divisor, 2))
        tried = dataclasses.replace(weights, min_probability=round(float(share), 3), min_odds=odds)
        choices = [(accept(t, tried, made_with)[0], t.truth) for t in tables if t.truth != NONE]
        right = [name == truth for name, truth in choices if name]
        if (len(right) - sum(right) + 1) <= options.max_wrong_share * max(len(right), 1):
            return tried
    return weights


def read_tables(files: Sequence[Path]) -> list[Table]:
    """Read the tables of takes: JSON lines, each an object with "tables" in its "notes", or a table itself.

    Raises:
        InvalidWeightsError: a file is missing or has no such lines.
    """
    found: list[Table] = []
    for file in files:
        try:
            lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines() if line.strip()]
            for line in lines:
                rows = [line] if "truth" in line else line.get("notes", {}).get("tables", [])
                found += [Table.from_dict(row) for row in rows]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InvalidWeightsError(f"cannot read tables from {file}: {error}") from error
    return found


def main(args: Sequence[str] | None = None) -> int:
    """Fit weights to files of takes and write them."""
    parser = argparse.ArgumentParser(
        prog="python -m uncom_reasoner.calibration.fit_weights", description="fit the posterior's weights"
    )
    parser.add_argument("takes", nargs="+", type=Path, help="takes.jsonl of benchmark runs with seeds of their own")
    parser.add_argument("--start", default="", help="weights that the takes were made with; default: the shipped ones")
    parser.add_argument("--out", type=Path, required=True, help="where to write the weights (YAML)")
    options = parser.parse_args(args)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    try:
        tables, start = read_tables(options.takes), load_weights(options.start)
        weights = choose_thresholds(tables, fit(tables, start), start)
    except ReasonerError as error:
        logger.error("%s", error)  # noqa: TRY400 (one line for the user)
        return 2
    for name, used in (("before", start), ("after", weights)):
        logger.info("%s: %s", name, summarize(tables, used, start))
    options.out.write_text(format_weights(weights), encoding="utf-8")
    return 0


def format_weights(weights: Weights) -> str:
    """Return weights as YAML with the shipped file's remarks."""
    values = dataclasses.asdict(weights)
    lines = []
    for line in DEFAULT_FILE.read_text(encoding="utf-8").splitlines():
        name = line.partition(":")[0]
        lines.append(f"{name}: {values[name]}" if name in values else line)
    return "\n".join(lines) + "\n"


def summarize(tables: Sequence[Table], weights: Weights, made_with: Weights) -> str:
    """Say how the weights do on tables."""
    present = [t for t in tables if t.truth != NONE]
    chosen = [accept(t, weights, made_with) for t in present]
    taken = [(thing == t.truth, share) for (thing, share), t in zip(chosen, present, strict=True) if thing]
    best = [max(reweigh(t, weights, made_with).items(), key=lambda kv: kv[1]) for t in tables]
    bins = reliability([q for _, q in best], [name == t.truth for (name, _), t in zip(best, tables, strict=True)])
    wrong = sum(not right for right, _ in taken)
    refused = sum(not accept(t, weights, made_with)[0] for t in tables if t.truth == NONE)
    return (
        f"{len(tables)} tables, {len(present)} with the thing: {len(taken)} taken, {wrong} of them wrong; "
        f"{refused} of {len(tables) - len(present)} refused where it was taken away; "
        f"calibration error {calibration_error(bins):.3f}"
    )


if __name__ == "__main__":
    sys.exit(main())
