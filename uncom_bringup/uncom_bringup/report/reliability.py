# SPDX-License-Identifier: Apache-2.0
"""The reliability diagram: how often choices of a probability were right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from uncom_bringup.report import svg
from uncom_bringup.report.options import RELIABILITY


def draw(bins: Sequence[Mapping[str, Any]], calibration_error: float) -> Markup:
    """Draw bins of {"low", "high", "count", "probability", "right"}; empty without any."""
    if not bins:
        return Markup("")

    def at(x: float, y: float) -> tuple[float, float]:
        return RELIABILITY.margin_px + x * RELIABILITY.size_px, 12.0 + (1.0 - y) * RELIABILITY.size_px

    most = max(int(one["count"]) for one in bins)
    parts = [svg.polygon([at(0, 0), at(1, 0), at(1, 1), at(0, 1)], "table"), svg.line(*at(0, 0), *at(1, 1), "guide")]
    for one in bins:
        x, y = at(float(one["low"]), float(one["right"]))
        width = (float(one["high"]) - float(one["low"])) * RELIABILITY.size_px
        title = f"{one['count']} choices of mean probability {one['probability']:.2f}: {100 * one['right']:.0f} % right"
        parts.append(svg.rectangle(x + 2, y, width - 4, at(0, 0)[1] - y, "word target", title))
        radius = 2.5 + 5.0 * (int(one["count"]) / most) ** 0.5
        cx, cy = at(float(one["probability"]), float(one["right"]))
        parts.append(svg.element("circle", cx=cx, cy=cy, r=radius, cls="ray"))
    for share in (0.0, 0.5, 1.0):
        x, y = at(share, share)
        parts.append(svg.text(f"{share:g}", x, at(0, 0)[1] + 16, "tick", "middle"))
        parts.append(svg.text(f"{share:g}", RELIABILITY.margin_px - 6, y + 4, "tick", "end"))
    parts.append(svg.text("probability", *at(0.5, -0.12), "tick", "middle"))
    parts.append(svg.text(f"expected calibration error {calibration_error:.3f}", *at(0.03, 0.94), "tick"))
    return svg.drawing(
        RELIABILITY.size_px + 2 * RELIABILITY.margin_px,
        RELIABILITY.size_px + 64,
        parts,
        "share of right choices over their probability",
    )
