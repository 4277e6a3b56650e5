# SPDX-License-Identifier: Apache-2.0
"""The report as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from uncom_sim.bench_understanding.judging.decision_quality import decision_text


def report_text(report: Mapping[str, Any]) -> str:
    """Write the tables of a report."""
    return "\n".join(_lines(report))


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    head = ("object", "distr.", "target", "distr.", "clutter")
    yield f"{'scenario':<52}{'takes':>6}{'right':>7}   {head[0]:<11}{head[1]:<8}{head[2]:<15}{head[3]:<8}{head[4]}"
    for one in report["scenarios"]:
        label = f"{one['id']:>2} {one['name']}"
        variants = (
            f"{one['object']:<11}{one['object_distractors']:<8}{one['target']:<15}{one['target_distractors']:<8}"
            f"{one['clutter']}"
        )
        yield f"{label[:50]:<52}{one['takes']:>6}{one['right']:>7}   {variants}"
    yield ""
    yield f"{'subject':<52}{'takes':>6}{'right':>7}   95 % interval"
    for subject, variants in report["subjects"].items():
        for name, of in variants.items():
            label = f"{subject.replace('_', ' ')}: {name}"
            yield f"{label:<52}{of['takes']:>6}{of['right']:>7}   {_interval(of['interval'])}"
    yield ""
    if report["deciding"]["takes"]:
        yield decision_text(report["deciding"])
        yield ""
    yield from _miss_lines(report)
    yield from _ablation_lines(report)
    yield "relations (meant -> understood): " + "; ".join(
        f"{meant} -> {', '.join(f'{name} {count}' for name, count in got.items())}"
        for meant, got in report["relations"].items()
    )
    yield "processor time a take [s]: " + ", ".join(
        f"{name} {of['mean']:.2f} (p95 {of['p95']:.2f})" for name, of in report["latency_s"].items()
    )
    if report["made"]["takes"]:
        yield f"made {report['made']['takes']} takes, {report['made']['cpu_s']:.1f} s of processor time each"
    yield f"seed {report['seed']}, {report['jobs']} jobs, {report['wall_s'] / 60.0:.1f} min"
    yield (
        f"right: {report['right']} of {report['takes']} = {100 * report['share']:.1f} %, "
        f"95 % interval {_interval(report['interval'])}; the paper: {report['paper']['right']} of "
        f"{report['paper']['takes']}, {_interval(report['paper']['interval'])}"
    )


def _ablation_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """Write what other ways of deciding came to, and whether the harness measures what it says."""
    rows = {"the paper's rules as published": report["published_rules"]}
    rows |= {name.replace("_", " "): of for name, of in report["ablations"].items()}
    if any(of["takes"] for of in rows.values()):
        yield f"{'the same takes decided otherwise':<52}{'takes':>6}{'right':>7}   95 % interval"
        for name, of in rows.items():
            yield f"{name:<52}{of['takes']:>6}{of['right']:>7}   {_interval(of['interval'])}"
        swapped, hand = report["checks"]["swapped_words"], report["checks"]["hand_removed_deictic"]
        other = swapped["other_meaning"]
        yield (
            f"check, sentences swapped within scenarios: {swapped['right']} of {swapped['takes']} right "
            f"(by chance {swapped['chance']}; {other['right']} of the {other['takes']} that ask for something else)"
        )
        yield (
            f"check, hand removed from deictic scenarios: {hand['right']} of {hand['takes']} right "
            f"(with the hand {hand['right_with_hand']})"
        )
        yield ""


def _miss_lines(report: Mapping[str, Any]) -> Iterator[str]:
    if not report["misses"]:
        return
    yield f"misses by the first stage that went wrong: {', '.join(f'{k} {v}' for k, v in report['stages'].items())}"
    for miss in report["misses"]:
        heard = "" if miss["heard"] == miss["said"] else f" heard {miss['heard']!r};"
        yield f"  {miss['take']} [{miss['stage'] or '?'}] {miss['said']!r};{heard} {miss['why']}"
    yield ""


def _interval(interval: list[float]) -> str:
    return f"{100 * interval[0]:.1f} to {100 * interval[1]:.1f} %"
