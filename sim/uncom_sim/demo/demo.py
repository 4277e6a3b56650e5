# SPDX-License-Identifier: Apache-2.0
"""`uncom demo`: a simulated person speaks and points, the whole graph understands and moves a simulated TIAGo++.

The demo starts the same nodes as on the robot, and the driver that stands for the robot. It only listens, tells the
person to begin, and scores at the end by the simulator's truth, which none of the six nodes sees.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from uncom_bringup.exceptions import GraphError
from uncom_bringup.graph.node_processes import GraphProcesses, ParameterValue
from uncom_bringup.graph.node_specs import DRIVER, EXECUTION_NODE, SIX_NODES
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_bringup.monitor.completion import waiting_for
from uncom_bringup.monitor.run_record import Event, RunRecord
from uncom_bringup.report import progress, summary

from uncom_sim.demo.options import DEMO_TIMING, DemoOptions, DemoTiming, scene_to_dict
from uncom_sim.demo.result import DemoResult
from uncom_sim.demo.score import score_run
from uncom_sim.scoring.end_state import PhysicalResult
from uncom_sim.types import ObjectState

if TYPE_CHECKING:
    from uncom_sim.demo.ros.demo_graph import DemoListeners

Say = Callable[[str], None]


@dataclass(slots=True)
class _Times:
    """Wall times of the phases [s]."""

    begin: float = field(default_factory=time.monotonic)
    marks: dict[str, float] = field(default_factory=dict)

    def mark(self, name: str) -> None:
        """Note how long the phase that ends now took."""
        self.marks[name] = round(time.monotonic() - self.begin - sum(self.marks.values()), 3)

    @property
    def total(self) -> float:
        """Since the beginning [s]."""
        return round(time.monotonic() - self.begin, 3)


@dataclass(frozen=True, slots=True)
class _RunData:
    """What one run left in memory."""

    record: RunRecord
    before: tuple[ObjectState, ...]
    after: tuple[ObjectState, ...]
    contacts: tuple[int, int]
    span_s: tuple[float, float]
    gave_up: str
    cpu_s: Mapping[str, float]


def run_demo(options: DemoOptions, say: Say) -> DemoResult:
    """Run one demo to its end; `say` gets a line for each step.

    Raises:
        GraphError: a node did not come up or died.
    """
    times = _Times()
    scene_file = options.folder / "scene.json"
    scene_file.write_text(json.dumps(scene_to_dict(options.scene), indent=2) + "\n", encoding="utf-8")
    with DomainClaim(_wanted_domain()) as claim:
        seen = _run_graph(options, scene_file, claim.domain, times, say)
    times.mark("stop")
    return _finish(options, seen, times, say)


def _wanted_domain() -> str | None:
    """The user's ROS domain id, if one is set."""
    return os.environ.get("ROS_DOMAIN_ID")


def _run_graph(options: DemoOptions, scene_file: Path, domain: int, times: _Times, say: Say) -> _RunData:
    say(progress.head("starting", f"six nodes and the simulator (ROS domain {domain})"))

    def tell(event: Event) -> None:
        words = progress.line(event)
        if words:
            say(words)

    with GraphProcesses(options.folder / "log", domain, options.parameter_files) as graph:
        graph.start(DRIVER, {"scene_file": str(scene_file.resolve()), "seed": options.seed})
        for spec in SIX_NODES:
            own: dict[str, ParameterValue] = {"use_sim_time": True}
            if spec is EXECUTION_NODE:
                own["require_approval"] = False
            graph.start(spec, own)
        # What listens and writes is imported while the nodes start.
        from uncom_bringup.report import run_files  # noqa: PLC0415

        from uncom_sim.demo.ros.demo_graph import DemoListeners  # noqa: PLC0415

        bag = options.folder / run_files.BAG_FILE if options.record else None
        with DemoListeners(domain, tell, bag, force=True) as listeners:
            _wait_until_up(graph, listeners)
            times.mark("start")
            begin_s = listeners.demo.now_s
            say(progress.head("person", "speaks and points"))
            listeners.demo.begin()
            gave_up = _wait_until_done(graph, listeners, options.timeout_s)
            times.mark("run")
            before, after, *contacts = listeners.demo.truth()
            end_s = listeners.demo.now_s
            cpu_s = {**graph.cpu_times_s(), "demo": time.process_time()}
            record = listeners.record()
    return _RunData(record, before, after, (contacts[0], contacts[1]), (begin_s, end_s), gave_up, cpu_s)


def _wait_until_up(graph: GraphProcesses, listeners: DemoListeners, timing: DemoTiming = DEMO_TIMING) -> None:
    deadline = time.monotonic() + timing.start_timeout_s
    while missing := listeners.missing():
        graph.check()
        if time.monotonic() > deadline:
            raise GraphError(
                "the graph", f"is not up after {timing.start_timeout_s:.0f} s; missing: {', '.join(missing)}"
            )
        time.sleep(timing.poll_s)


def _wait_until_done(
    graph: GraphProcesses, listeners: DemoListeners, timeout_s: float, timing: DemoTiming = DEMO_TIMING
) -> str:
    """Wait until everything said has been answered and objects have come to rest.

    Returns "" or, if the time is up, what was still waited for.
    """
    deadline = time.monotonic() + timeout_s
    settled_s: float | None = None
    while True:
        graph.check()
        done_s = listeners.demo.person_done_s
        waiting = waiting_for(listeners.record(), None if done_s is None else done_s + timing.tail_s)
        now_s = listeners.demo.now_s
        if waiting is not None:
            settled_s = None
        elif settled_s is None:
            settled_s = now_s + timing.settle_s
        elif now_s >= settled_s:
            return ""
        if time.monotonic() > deadline:
            return f"gave up after {timeout_s:.0f} s waiting for {waiting or 'the objects to come to rest'}"
        time.sleep(timing.poll_s)


def _finish(options: DemoOptions, seen: _RunData, times: _Times, say: Say) -> DemoResult:
    """Score, and write what the run leaves behind."""
    from uncom_bringup.report import run_files  # noqa: PLC0415
    from uncom_bringup.report.report_page import Outcome  # noqa: PLC0415

    record = seen.record
    scene = options.scene
    score = score_run(scene, record, seen.before, seen.after)
    reason = seen.gave_up or summary.failure(record) or ("" if score.physical.success else score.physical.reason)
    success = not reason and score.physical.success
    physical = replace(score.physical, success=success, reason=reason or score.physical.reason)
    result = DemoResult(
        heard=summary.heard(record),
        understood=summary.understood(record),
        chosen=score.chosen,
        physical=physical,
        success=success,
        reason=reason,
        timings_s={},
        backends=summary.backends(record),
        artifacts={},
    )
    timings = {
        **summary.timings(record),
        **{f"cpu_{name}": round(value, 2) for name, value in seen.cpu_s.items()},
        "simulated": round(seen.span_s[1] - seen.span_s[0], 3),
        **{f"wall_{name}": value for name, value in times.marks.items()},
    }
    say(progress.head("writing", f"report, video and bag to {options.folder}"))
    made = run_files.write_run_files(
        options.folder,
        f"UNCOM demo: {scene.name}, seed {options.seed}",
        record,
        Outcome(success, result.in_words().partition(": ")[2], _physical_rows(physical, score.chosen, seen.contacts)),
        timings,
        heard=result.heard,
        span_s=seen.span_s if options.video else None,
    )
    times.mark("report")
    timings |= {"wall_report": times.marks["report"], "wall_total": times.total}
    return replace(result, timings_s=timings, artifacts={**made, "log": str(options.folder / "log")})


def _physical_rows(physical: PhysicalResult, chosen: Any, contacts: tuple[int, int]) -> dict[str, str]:
    def named(key: str) -> str:
        value = chosen[key]
        return "-" if value is None else str(value)

    return {
        "object taken for": named("object"),
        "target taken for": named("target"),
        "free place": named("area"),
        "object moved": f"{100 * physical.object_moved_m:.1f} cm",
        "others moved at most": f"{100 * physical.others_moved_m:.1f} cm",
        "steps with robot and table in contact": str(contacts[0]),
        "steps with robot and a bystander in contact": str(contacts[1]),
    }
