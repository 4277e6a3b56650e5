# SPDX-License-Identifier: Apache-2.0
"""The simulated robot without ROS: the engine steps physics as far as each of its calls needs, faster than real time.

Below are the same controllers as behind ROS, and its eyes are the same camera and detector.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from uncom_common.transforms import invert
from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.objects.tracking.external_models import with_models
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import FloatArray, ObjectModel, Scene
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.execution.base_driver import drive_velocity
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.robot.gripper_joints import finger_gap, finger_motion
from uncom_tiago_exec.types import BasePose, Side, Trajectory

from uncom_sim.bench_execution.options import STEPS, StepOptions
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.controllers.joint_trajectory import Outcome
from uncom_sim.controllers.tolerances import GoalTolerances, Tolerance
from uncom_sim.controllers.trajectory import Trajectory as Goal
from uncom_sim.controllers.trajectory import Waypoint
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.scoring.options import ACTS
from uncom_sim.types import ObjectState
from uncom_sim.world.simulator import Simulator

#: An estimator of poses beside the robot: from the truth and the pose (4, 4) of the base to models in the base's frame.
Estimate = Callable[[Sequence[ObjectState], FloatArray], Sequence[ObjectModel]]


class SteppedRobot(RobotInterface):
    """Steps a simulator in the thread of its caller."""

    def __init__(
        self,
        simulator: Simulator,
        watch: Callable[[], None] | None = None,
        estimate: Estimate | None = None,
        *,
        options: StepOptions = STEPS,
    ) -> None:
        """Keep the simulator; watch is called after each motion (to take a picture, say), `observer` every 0.1 s.

        With `estimate`, what is seen is completed by its models, as by those of /uncom/object_poses.
        """
        self._options = options
        self.simulator = simulator
        self.stop_at_s: float | None = None
        self.observer: Callable[[], None] | None = None
        self._lexicon = load_lexicon()
        self._detector = TabletopDetector(self._lexicon)
        self._watch = watch
        self._estimate = estimate

    def positions(self) -> dict[str, float]:
        """Return joint positions; see RobotInterface."""
        state = self.simulator.joint_state()
        return dict(zip(state.names, state.positions.tolist(), strict=True))

    def follow(self, trajectory: Trajectory) -> None:
        """Carry out a trajectory; see RobotInterface."""
        for name, end in self._run(trajectory).items():
            if end.code != 0:
                raise MotionError(f"{name} gave up: {end.text}")

    def grip(self, side: Side, gap: float) -> float:
        """Bring the fingers to a gap; see RobotInterface."""
        self._run(finger_motion(side, gap, self.positions()))
        return finger_gap(side, self.positions())

    def base_pose(self) -> BasePose:
        """Return where the base stands by its odometry; see RobotInterface."""
        odometry = self.simulator.base.odometry
        return BasePose(odometry.x, odometry.y, odometry.yaw)

    def drive(self, distance: float) -> None:
        """Drive the base by odometry; see RobotInterface."""
        simulator = self.simulator
        start = self.base_pose()
        while True:
            if self.stop_at_s is not None and simulator.time_s >= self.stop_at_s:
                simulator.base.command(0.0, 0.0, simulator.time_s)
                raise StoppedError("stopped on request")
            velocity = drive_velocity(distance - start.distance_ahead(self.base_pose()))
            simulator.base.command(velocity, 0.0, simulator.time_s)
            if velocity == 0.0 and abs(simulator.base.odometry.linear) < self._options.base_still_m_s:
                return
            self.rest(self._options.drive_steps)

    def look(self) -> Scene:
        """Take a picture now; see RobotInterface."""
        self.rest(self._options.rest_steps)
        rgb, depth = self.simulator.render_camera()
        base = self.simulator.robot.frame("base_footprint")
        camera = invert(base) @ self.simulator.robot.frame(CAMERA_FRAME)
        scene = self._detector.detect(RgbdFrame(rgb, depth, HEAD_CAMERA, camera), ["objects"])
        if self._estimate is None:
            return scene
        models = self._estimate(self.simulator.object_states(), base)
        return with_models(scene, models, self._lexicon.same, camera[:3, 3])

    def rest(self, steps: int) -> None:
        """Let time pass."""
        for _ in range(steps):
            self._step()

    def _step(self) -> None:
        self.simulator.step()
        if self.observer is not None and self.simulator.steps % ACTS.observed_steps == 0:
            self.observer()

    def _goals(self, trajectory: Trajectory) -> dict[str, Goal]:
        """Return each controller's part of a motion."""
        goals = {}
        for name, controller in self.simulator.controllers.items():
            joints = controller.config.joints
            if set(joints) <= set(trajectory.joint_names):
                columns = [trajectory.joint_names.index(j) for j in joints]
                points = zip(trajectory.times, trajectory.positions, trajectory.velocities, strict=True)
                goals[name] = Goal(
                    tuple(joints), tuple(Waypoint(float(t), q[columns], v[columns]) for t, q, v in points)
                )
        return goals

    def _run(self, trajectory: Trajectory) -> dict[str, Outcome]:
        """Follow a motion to its end, or to the moment of a stop."""
        simulator, goals = self.simulator, self._goals(trajectory)
        ends: dict[str, Outcome] = {}
        path = {name: Tolerance(trajectory.tolerance) for name in trajectory.joint_names}
        for name, goal in goals.items():
            done = partial(ends.__setitem__, name)
            simulator.controllers[name].start(goal, simulator.time_s, GoalTolerances(path), done)
        while len(ends) < len(goals):
            if any(end.code != 0 for end in ends.values()):  # what one gave up the others do not go on with
                for name in goals.keys() - ends.keys():
                    controller = simulator.controllers[name]
                    controller.cancel(simulator.joint_positions(controller.config.joints))
            if self.stop_at_s is not None and simulator.time_s >= self.stop_at_s:
                for name in goals:
                    controller = simulator.controllers[name]
                    controller.cancel(simulator.joint_positions(controller.config.joints))
                raise StoppedError("stopped on request")
            self._step()
        if self._watch is not None:
            self._watch()
        return ends
