# SPDX-License-Identifier: Apache-2.0
"""The report as one HTML page with the pictures of every miss in it."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment
from uncom_bringup.report import reliability

from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.reporting.text import report_text

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Benchmark of understanding, seed {{ report.seed }}</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 90em; padding: 0 1em; }
table { border-collapse: collapse; } td, th { padding: .2em .8em; text-align: left; border-bottom: 1px solid #ccc; }
pre { background: #f5f5f5; padding: 1em; overflow-x: auto; } img { max-width: 100%; }
svg .table { fill: #fafafa; stroke: #999; } svg .guide { stroke: #999; stroke-dasharray: 4 3; }
svg .word { fill: #c3d9fb; } svg .ray { fill: #18a558; } svg text { font: 12px system-ui, sans-serif; fill: #555; }
.bar { background: #ddd; width: 12em; height: .8em; } .bar div { background: #2a7; height: 100%; }
</style></head><body>
<h1>{{ report.right }} of {{ report.takes }} takes understood</h1>
<p>{{ "%.1f"|format(100 * report.share) }} %, 95 % interval {{ "%.1f"|format(100 * report.interval[0]) }} to
{{ "%.1f"|format(100 * report.interval[1]) }} %; seed {{ report.seed }}.
The paper: {{ report.paper.right }} of {{ report.paper.takes }}.</p>
<table><tr><th>scenario</th><th>object</th><th>distractors</th><th>target</th><th>distractors</th><th>clutter</th>
<th>right</th><th></th></tr>
{% for one in report.scenarios %}<tr><td>{{ one.id }} {{ one.name }}</td><td>{{ one.object }}</td>
<td>{{ one.object_distractors }}</td><td>{{ one.target }}</td><td>{{ one.target_distractors }}</td>
<td>{{ one.clutter }}</td><td>{{ one.right }} of {{ one.takes }}</td>
<td><div class="bar"><div style="width:{{ 100 * one.right / one.takes }}%"></div></div></td></tr>
{% endfor %}</table>
{% if reliability %}<h2>How far its probabilities can be trusted</h2>
<div style="max-width:26em">{{ reliability }}</div>{% endif %}
<h2>All figures</h2><pre>{{ text }}</pre>
<h2>Misses</h2>
<p>Blue crosses mark what was meant; orange is what was chosen, green the pointing ray that was seen.</p>
{% for one in misses %}<h3>{{ one.take }}: {{ one.said }}</h3>
<p>{% if one.heard != one.said %}Heard: {{ one.heard or "nothing" }}. {% endif %}First wrong: <b>{{ one.stage }}</b>;
{{ one.why }}. The person pointed {{ one.manner }}.</p>
{% for picture in one.pictures %}<img alt="{{ one.take }}" src="data:image/jpeg;base64,{{ images[picture] }}">
{% endfor %}{% endfor %}</body></html>
"""


def report_page(report: Mapping[str, Any], outcomes: Sequence[Outcome], pictures: Path) -> str:
    """Write the page; it needs nothing else to open."""
    misses = [one for one in outcomes if not one.right]
    names = {name for one in misses for name in one.pictures if (pictures / name).exists()}
    images = {name: base64.b64encode((pictures / name).read_bytes()).decode() for name in names}
    template = Environment(autoescape=True).from_string(_PAGE)
    deciding = report["deciding"]
    diagram = reliability.draw(deciding["reliability"], deciding["calibration_error"])
    return str(
        template.render(report=report, reliability=diagram, text=report_text(report), misses=misses, images=images)
    )
