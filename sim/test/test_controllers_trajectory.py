# SPDX-License-Identifier: Apache-2.0
"""Trajectory controllers follow, refuse, tolerate and stop as joint_trajectory_controller does."""

import numpy as np
import pytest
from uncom_sim.controllers.joint_trajectory import TrajectoryController, TrajectoryControllerConfig
from uncom_sim.controllers.robot_controllers import TRAJECTORY_CONTROLLERS
from uncom_sim.controllers.tolerances import GoalTolerances, Tolerance
from uncom_sim.controllers.trajectory import ErrorCode, Trajectory, TrajectoryError, Waypoint, check, sample

JOINTS = ("a", "b")
CONFIG = TrajectoryControllerConfig("c", JOINTS, goal_tolerance=0.02, goal_time_s=0.5)


def _points(rng, count, derivatives):
    points = []
    for i in range(count):
        values = [rng.uniform(-1, 1, 2) if k <= derivatives else None for k in range(3)]
        points.append(Waypoint(float(i) + 0.5, *values))
    return points


def _to(*goals, joints=JOINTS, start_s=0.0, step_s=1.0):
    points = tuple(Waypoint((i + 1) * step_s, np.array(goal, dtype=float)) for i, goal in enumerate(goals))
    return Trajectory(joints, points, start_s)


class _Ideal:
    """Joints that are at their set-point at once, unless they are stuck."""

    def __init__(self, controller, stuck=None):
        self.controller, self.now, self.outcomes = controller, 10.0, []
        self.position, self.velocity = controller.desired.positions.copy(), np.zeros(2)
        self.stuck = stuck

    def start(self, trajectory, tolerances=None):
        self.controller.start(trajectory, self.now, tolerances, self.outcomes.append)

    def run(self, seconds):
        for _ in range(round(seconds * 100)):
            self.now += 0.01
            point = self.controller.update(self.now, self.position, self.velocity)
            self.position, self.velocity = point.positions.copy(), point.velocities.copy()
            if self.stuck is not None:
                self.position[0], self.velocity[0] = self.stuck, 0.0


@pytest.fixture
def plant():
    return _Ideal(TrajectoryController(CONFIG, np.zeros(2)))


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_splines_pass_through_waypoints_with_the_derivatives_asked_for(derivatives):
    points = _points(np.random.default_rng(derivatives), 4, derivatives)
    for point in points[1:-1]:
        for side in (-1e-7, 1e-7):
            at = sample(points, point.time_s + side)
            np.testing.assert_allclose(at.positions, point.positions, atol=1e-5)
            if derivatives >= 1:
                np.testing.assert_allclose(at.velocities, point.velocities, atol=1e-4)
            if derivatives >= 2:
                np.testing.assert_allclose(at.accelerations, point.accelerations, atol=1e-3)


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_velocities_are_the_slope_of_positions(derivatives):
    points = _points(np.random.default_rng(7), 3, derivatives)
    for t in (0.7, 1.2, 1.9, 2.3):
        h = 1e-5
        slope = (sample(points, t + h).positions - sample(points, t - h).positions) / (2 * h)
        np.testing.assert_allclose(sample(points, t).velocities, slope, atol=1e-4)
        if derivatives:
            bend = (sample(points, t + h).velocities - sample(points, t - h).velocities) / (2 * h)
            np.testing.assert_allclose(sample(points, t).accelerations, bend, atol=1e-3)


def test_before_the_first_and_after_the_last_waypoint_it_rests():
    points = _points(np.random.default_rng(1), 3, 1)
    for t, point in ((0.0, points[0]), (99.0, points[-1])):
        np.testing.assert_array_equal(sample(points, t).positions, point.positions)
        np.testing.assert_array_equal(sample(points, t).velocities, 0.0)


@pytest.mark.parametrize(
    ("trajectory", "code", "text"),
    [
        (_to([0.0], joints=("a",)), ErrorCode.INVALID_JOINTS, "a, b"),
        (_to([0.0, 0.0], joints=("a", "x")), ErrorCode.INVALID_JOINTS, "a, b"),
        (_to([0.0, 0.0], joints=("a", "a")), ErrorCode.INVALID_JOINTS, "once"),
        (Trajectory(JOINTS, ()), ErrorCode.INVALID_GOAL, "no points"),
        (_to([0.0]), ErrorCode.INVALID_GOAL, "1 positions for 2 joints"),
        (_to([0.0, np.nan]), ErrorCode.INVALID_GOAL, "finite"),
        (_to([0.0, 0.0], [1.0, 1.0], step_s=0.0), ErrorCode.INVALID_GOAL, "time_from_start of point 1"),
        (_to([0.0, 0.0], start_s=5.0), ErrorCode.OLD_HEADER_TIMESTAMP, "past"),
        (
            Trajectory(JOINTS, (Waypoint(1.0, np.zeros(2), np.ones(2)),)),
            ErrorCode.INVALID_GOAL,
            "velocities of the last point",
        ),
    ],
)
def test_what_cannot_be_followed_is_refused_with_the_reason(trajectory, code, text):
    with pytest.raises(TrajectoryError, match=text) as caught:
        check(trajectory, JOINTS, 10.0)
    assert caught.value.code is code


def test_joints_may_be_named_in_any_order(plant):
    plant.start(_to([0.3, 0.7], joints=("b", "a")))
    plant.run(1.1)
    np.testing.assert_allclose(plant.position, (0.7, 0.3), atol=1e-6)
    assert [o.code for o in plant.outcomes] == [ErrorCode.SUCCESSFUL]


def test_a_start_time_in_the_future_stretches_the_way_to_the_first_waypoint(plant):
    plant.start(_to([1.0, 1.0], start_s=plant.now + 1.0))
    plant.run(1.0)
    np.testing.assert_allclose(plant.position, 0.5, atol=1e-6)
    plant.run(0.9)
    assert not plant.outcomes
    plant.run(0.2)
    assert plant.outcomes[0].code is ErrorCode.SUCCESSFUL


def test_a_start_time_in_the_past_joins_the_trajectory_where_it_is(plant):
    plant.start(_to([1.0, 1.0], [2.0, 2.0], start_s=plant.now - 1.5))
    plant.run(0.55)
    np.testing.assert_allclose(plant.position, 2.0, atol=1e-6)


def test_a_new_goal_ends_the_old_one_and_moves_on_without_a_jump(plant):
    plant.start(_to([1.0, 1.0]))
    plant.run(0.5)
    here = plant.position.copy()
    plant.start(_to([0.0, 0.0]))
    assert [o.code for o in plant.outcomes] == [ErrorCode.INVALID_GOAL]
    plant.run(0.01)
    np.testing.assert_allclose(plant.position, here, atol=0.02)
    plant.run(1.0)
    assert plant.outcomes[-1].code is ErrorCode.SUCCESSFUL


def test_a_refused_goal_leaves_the_active_one_alone(plant):
    plant.start(_to([1.0, 1.0]))
    with pytest.raises(TrajectoryError):
        plant.start(Trajectory(JOINTS, ()))
    plant.run(1.1)
    assert [o.code for o in plant.outcomes] == [ErrorCode.SUCCESSFUL]


def test_cancel_holds_the_joints_where_they_are(plant):
    plant.start(_to([1.0, 1.0]))
    plant.run(0.4)
    here = plant.position.copy()
    plant.controller.cancel(plant.position)
    plant.run(2.0)
    np.testing.assert_allclose(plant.position, here)
    assert plant.outcomes[0].cancelled
    assert not plant.controller.active


def test_a_stuck_joint_fails_after_the_goal_time():
    plant = _Ideal(TrajectoryController(CONFIG, np.zeros(2)), stuck=0.0)
    plant.start(_to([1.0, 1.0]))
    plant.run(1.4)
    assert not plant.outcomes
    plant.run(0.2)
    assert plant.outcomes[0].code is ErrorCode.GOAL_TOLERANCE_VIOLATED
    assert "a is 1.0000 off" in plant.outcomes[0].text
    np.testing.assert_allclose(plant.controller.desired.positions, plant.position)


@pytest.mark.parametrize(
    ("tolerance", "ends"),
    [(Tolerance(), False), (Tolerance(position=-1.0), True), (Tolerance(position=2.0), True), (Tolerance(0.5), False)],
)
def test_goal_tolerance_of_zero_is_the_default_and_minus_one_no_limit(tolerance, ends):
    plant = _Ideal(TrajectoryController(CONFIG, np.zeros(2)), stuck=0.0)
    plant.start(_to([1.0, 1.0]), GoalTolerances(goal={"a": tolerance}))
    plant.run(1.1)
    assert [o.code for o in plant.outcomes] == ([ErrorCode.SUCCESSFUL] if ends else [])


def test_goal_time_of_minus_one_waits_for_ever_and_a_longer_one_longer():
    for goal_time, failed in ((-1.0, False), (3.0, False), (0.0, True)):
        plant = _Ideal(TrajectoryController(CONFIG, np.zeros(2)), stuck=0.0)
        plant.start(_to([1.0, 1.0]), GoalTolerances(goal_time_s=goal_time))
        plant.run(3.5)
        assert bool(plant.outcomes) is failed


def test_path_tolerance_aborts_on_the_way_only_when_asked_for():
    for tolerances, failed in ((GoalTolerances(path={"a": Tolerance(0.1)}), True), (GoalTolerances(), False)):
        plant = _Ideal(TrajectoryController(CONFIG, np.zeros(2)), stuck=0.0)
        plant.start(_to([1.0, 1.0]), tolerances)
        plant.run(0.5)
        assert [o.code for o in plant.outcomes] == ([ErrorCode.PATH_TOLERANCE_VIOLATED] if failed else [])


def test_a_gripper_told_to_hold_keeps_pressing_what_it_holds():
    config = next(c for c in TRAJECTORY_CONTROLLERS if c.name == "gripper_left_controller")
    plant = _Ideal(TrajectoryController(config, np.full(2, 0.044)), stuck=0.03)
    plant.start(Trajectory(config.joints, (Waypoint(0.5, np.zeros(2)),)))
    plant.run(2.0)
    assert plant.outcomes[0].code is ErrorCode.GOAL_TOLERANCE_VIOLATED
    assert plant.controller.desired.positions[0] < 0.03


def test_the_robots_controllers_name_its_joints_once_each():
    names = [joint for config in TRAJECTORY_CONTROLLERS for joint in config.joints]
    assert len(names) == len(set(names)) == 21
    assert {c.name for c in TRAJECTORY_CONTROLLERS} == {
        "arm_left_controller",
        "arm_right_controller",
        "torso_controller",
        "head_controller",
        "gripper_left_controller",
        "gripper_right_controller",
    }
