# SPDX-License-Identifier: Apache-2.0
"""The engine on the real physics, without ROS: the simulator's controllers below, the tabletop detector as its eyes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from exec_fixtures import robot
from PIL import Image
from uncom_common.transforms import invert
from uncom_perception.objects.tabletop import TabletopDetector
from uncom_perception.types import Detection, Scene
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.controllers.joint_trajectory import Outcome as ControllerOutcome
from uncom_sim.controllers.trajectory import Trajectory as ControllerTrajectory
from uncom_sim.controllers.trajectory import Waypoint
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.scene import scene_from_dict
from uncom_sim.scoring import PhysicalResult, judge
from uncom_sim.simulator import Simulator
from uncom_sim.types import Meaning
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.engine import Engine
from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.obstacles import upright
from uncom_tiago_exec.robot_interface import RobotInterface
from uncom_tiago_exec.robot_model import finger_joints
from uncom_tiago_exec.types import ManipulationTask, Outcome, Status


class SimulatedRobot(RobotInterface):
    """Steps a simulator as far as each call needs."""

    def __init__(self, simulator: Simulator, shots: str | None = None) -> None:
        self.simulator = simulator
        self._detector = TabletopDetector()
        self._shots = shots
        self._count = 0

    def positions(self):
        state = self.simulator.joint_state()
        return dict(zip(state.names, state.positions.tolist(), strict=True))

    def follow(self, trajectory):
        ends = self._run(trajectory, [n for n, c in self.simulator.controllers.items() if _covers(c, trajectory)])
        for name, end in ends.items():
            if end.code != 0:
                raise MotionError(f"{name} gave up: {end.text}")

    def grip(self, side, gap):
        joints = finger_joints(side)
        start = np.array([self.positions()[j] for j in joints])
        end = np.clip(np.full(2, gap / 2), 0.0, 0.044)
        name = f"gripper_{side}_controller"
        duration = max(0.3, float(np.abs(end - start).max()) / 0.04)
        points = (Waypoint(duration, end, np.zeros(2)),)
        self._run(ControllerTrajectory(joints, points), [name])
        return float(sum(self.positions()[j] for j in joints))

    def _run(self, trajectory, names):
        ends: dict[str, ControllerOutcome] = {}
        for name in names:
            part = trajectory
            joints = self.simulator.controllers[name].config.joints
            if not isinstance(trajectory, ControllerTrajectory):
                columns = [trajectory.joint_names.index(j) for j in joints]
                points = tuple(
                    Waypoint(float(t), q[columns], v[columns])
                    for t, q, v in zip(trajectory.times, trajectory.positions, trajectory.velocities, strict=True)
                )
                part = ControllerTrajectory(tuple(joints), points)
            self.simulator.controllers[name].start(
                part, self.simulator.time_s, done=lambda end, n=name: ends.__setitem__(n, end)
            )
        while len(ends) < len(names):
            self.simulator.step()
        self.shot()
        return ends

    def look(self):
        for _ in range(24):
            self.simulator.step()
        rgb, depth = self.simulator.render_camera()
        base = self.simulator.robot.frame("base_footprint")
        camera = invert(base) @ self.simulator.robot.frame(CAMERA_FRAME)
        return self._detector.detect(rgb, depth, HEAD_CAMERA, camera, ["objects"])

    def shot(self):
        if self._shots:
            self._count += 1
            Image.fromarray(self.simulator.render_overview()).save(f"{self._shots}_{self._count:02d}.png")


def _covers(controller, trajectory):
    return set(controller.config.joints) <= set(trajectory.joint_names)


@dataclass
class Run:
    """What came of one command."""

    outcome: Outcome
    physical: PhysicalResult
    told: list[Status] = field(default_factory=list)
    table_touches: int = 0
    bystander_touches: int = 0
    home_error: float = 0.0

    @property
    def success(self):
        return self.outcome.success and self.physical.success and self.table_touches == 0


def nearest(scene: Scene, xy) -> Detection:
    """The detection whose cloud's middle is nearest to a place."""
    return min(
        (d for d in scene.detections if d.geometry is not None),
        key=lambda d: float(np.linalg.norm(np.median(d.geometry.cloud[:, :2], axis=0) - xy)),
    )


def carry_out(objects, primitive, obj, target=None, place=None, *, seed=0, shots=None, config=None):
    """Carry out one command in a scene of (kind, x, y, yaw); obj and target are indices into it."""
    listed = [
        {"id": f"o{i}", "kind": kind, "x": x, "y": y, "yaw": yaw, **({"colour": c[0]} if c else {})}
        for i, (kind, x, y, yaw, *c) in enumerate(objects)
    ]
    simulator = Simulator(scene_from_dict({"objects": listed, "say": "take it"}), seed)
    try:
        machine = SimulatedRobot(simulator, shots)
        start = machine.positions()
        before = simulator.object_states()
        scene = machine.look()
        thing = nearest(scene, before[obj].position[:2])
        goal = nearest(scene, before[target].position[:2]) if target is not None else None
        pose = None if place is None else upright(np.array([*place, scene.table.height_m]), 0.0)
        kind = objects[obj][0]
        task = ManipulationTask(
            "u", 0, primitive, "none", thing, scene.detections, scene.table, goal, pose, kind,
            objects[target][0] if target is not None else "",
        )  # fmt: skip
        told: list[Status] = []
        engine = Engine(robot(), machine, config or ExecutionConfig(seed=seed + 1), told.append)
        outcome = engine.execute(task)
        for _ in range(240):
            simulator.step()
        where = {"put_in": "in", "put_on": "on", "stack": "on", "place": "area", "pick": "none"}[primitive]
        meaning = Meaning(f"o{obj}", where, f"o{target}" if target is not None else None, place)
        physical = judge(before, simulator.object_states(), meaning, simulator.world.scene.table)
        end = machine.positions()
        moved = max(abs(end[n] - start[n]) for n in start if "wheel" not in n and "finger" not in n)
        return Run(outcome, physical, told, simulator.contacts.table, simulator.contacts.bystanders, moved)
    finally:
        simulator.close()
