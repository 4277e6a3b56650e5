# SPDX-License-Identifier: Apache-2.0
"""The table from above as the robot stands before it: Voronoi cells, what occupies them, and the chosen place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from uncom_bringup.monitor.run_record import STATUS_GROUNDED, TARGET_OBJECT
from uncom_bringup.report import svg
from uncom_bringup.report.options import MAP

_TRIANGLE_CORNERS = 3


@dataclass(frozen=True, slots=True)
class _Plan:
    """From the support's coordinates to the drawing.

    In metres x (away from the robot) goes up and y (left) goes left; in pixels u and v stay as they are.
    """

    metric: bool
    low: tuple[float, float]
    scale: float

    def at(self, point: Sequence[float]) -> tuple[float, float]:
        """Place of a point in the drawing."""
        across, down = (-point[1], -point[0]) if self.metric else (point[0], point[1])
        return MAP.margin_px + (across - self.low[0]) * self.scale, MAP.margin_px + (down - self.low[1]) * self.scale

    def inside(self, size: tuple[float, float], place: tuple[float, float]) -> bool:
        """Whether a place lies in a drawing of this size."""
        return 0.0 <= place[0] <= size[0] and 0.0 <= place[1] <= size[1]


def draw(explanation: Mapping[str, Any], grounded: Mapping[str, Any]) -> Markup:
    """Draw the map of one decision; empty if the table was not seen."""
    table = explanation.get("table") or {}
    outline = table.get("polygon") or []
    if len(outline) < _TRIANGLE_CORNERS:
        return Markup("")
    plan, height = _plan(bool(table.get("metric", True)), outline)
    parts = [svg.polygon([plan.at(p) for p in outline], "table")]
    for cell in explanation.get("cells") or ():
        state = "chosen" if cell["chosen"] else ("occupied" if cell["occupied_by"] else "free")
        title = f"{cell['id']}: {state}" + (f" by {cell['occupied_by']}" if cell["occupied_by"] else "")
        parts.append(svg.polygon([plan.at(p) for p in cell["polygon"]], f"cell {state}", title))
    if plan.metric:
        parts += _things(plan, grounded)
        parts += _rays(plan, explanation, (MAP.width_px, height))
    parts += _place(plan, explanation)
    if plan.metric:
        parts.append(svg.text("robot", MAP.width_px / 2, height - 7, "tick", "middle"))
        parts.append(svg.text("10 cm", MAP.margin_px + 0.05 * plan.scale, height - 9, "tick", "middle"))
        parts.append(svg.line(MAP.margin_px, height - 6, MAP.margin_px + 0.1 * plan.scale, height - 6, "axis"))
    return svg.drawing(MAP.width_px, height, parts, "map of the table with occupied, free and chosen cells")


def _plan(metric: bool, outline: Sequence[Sequence[float]]) -> tuple[_Plan, float]:
    turned = [(-p[1], -p[0]) if metric else (p[0], p[1]) for p in outline]
    low = min(p[0] for p in turned), min(p[1] for p in turned)
    high = max(p[0] for p in turned), max(p[1] for p in turned)
    scale = (MAP.width_px - 2 * MAP.margin_px) / max(1e-6, high[0] - low[0])
    return _Plan(metric, low, scale), 2 * MAP.margin_px + (high[1] - low[1]) * scale


def _things(plan: _Plan, grounded: Mapping[str, Any]) -> Iterator[str]:
    object_id = grounded["object"]["id"] if grounded["status"] == STATUS_GROUNDED else ""
    target = grounded["target"]
    target_id = target["object"]["id"] if target["kind"] == TARGET_OBJECT else ""
    drawn = set()
    for thing in (*grounded["scene"], grounded["object"], target["object"]):
        if not thing["has_geometry"] or thing["id"] in drawn:
            continue
        drawn.add(thing["id"])
        state = "object" if thing["id"] == object_id else ("receiver" if thing["id"] == target_id else "")
        yield svg.polygon([plan.at(p) for p in _footprint(thing)], f"thing {state}", f"{thing['id']} {thing['label']}")
        x, y = plan.at((thing["centroid"]["x"], thing["centroid"]["y"]))
        yield svg.text(thing["label"] or thing["id"], x, y + 4, "thingname", "middle")


def _footprint(thing: Mapping[str, Any]) -> list[tuple[float, float]]:
    position, q, size = thing["pose"]["position"], thing["pose"]["orientation"], thing["size"]
    yaw = math.atan2(2.0 * (q["w"] * q["z"] + q["x"] * q["y"]), 1.0 - 2.0 * (q["y"] ** 2 + q["z"] ** 2))
    cosine, sine = math.cos(yaw), math.sin(yaw)
    corners = []
    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        dx, dy = a * size["x"] / 2.0, b * size["y"] / 2.0
        corners.append((position["x"] + cosine * dx - sine * dy, position["y"] + sine * dx + cosine * dy))
    return corners


def _rays(plan: _Plan, explanation: Mapping[str, Any], size: tuple[float, float]) -> Iterator[str]:
    for ray in (explanation.get("rays") or {}).values():
        for dwell in ray["dwells"]:
            tip, direction = dwell["tip"], dwell["direction"]
            if tip is None or direction is None:
                continue
            begin = plan.at(tip)
            end = begin
            # Drawn to the table or to the border of the map, whichever comes first.
            for step in range(1, 101):
                reach = MAP.ray_m * step / 100.0
                place = plan.at((tip[0] + reach * direction[0], tip[1] + reach * direction[1]))
                height = tip[2] + reach * direction[2]
                if not plan.inside(size, place) or height < _support_height(explanation):
                    break
                end = place
            yield svg.line(*begin, *end, "rayline")
            yield svg.element("circle", cx=begin[0], cy=begin[1], r=3.5, cls="ray")


def _support_height(explanation: Mapping[str, Any]) -> float:
    position = (explanation.get("target") or {}).get("position")
    return float(position[2]) - 0.02 if position else 0.0


def _place(plan: _Plan, explanation: Mapping[str, Any]) -> Iterator[str]:
    target = explanation.get("target") or {}
    point = target.get("point")
    if point:
        (a, b), (_, d) = point["covariance"]
        x, y = plan.at(point["mean"])
        radius = 2.0 * math.sqrt(max(1e-12, (a + d + math.hypot(a - d, 2.0 * b)) / 2.0)) * plan.scale
        yield svg.element("circle", cx=x, cy=y, r=min(radius, MAP.width_px / 3), cls="uncertain")
    position = target.get("position")
    if position and plan.metric:
        x, y = plan.at(position)
        yield svg.line(x - 8, y, x + 8, y, "goal")
        yield svg.line(x, y - 8, x, y + 8, "goal")
