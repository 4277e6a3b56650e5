# SPDX-License-Identifier: Apache-2.0
"""The behaviour of the simulated person: it speaks, points at object and place in time with the words, and leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, Slerp

from uncom_sim.person.acoustics import insert_pause, record
from uncom_sim.person.attributes import PersonAttributes, draw_attributes
from uncom_sim.person.hand_model import Hand, build_hand
from uncom_sim.person.hand_placement import ARM_AZIMUTH, Obstacle, Placement, place_hand, robot_viewpoint
from uncom_sim.person.options import BEHAVIOUR, BehaviourOptions
from uncom_sim.person.phrases import find_phrases
from uncom_sim.person.voice import speak
from uncom_sim.types import SIDES, PersonOptions, SpokenWord, Table

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pointing:
    """What the finger is on, and when: role "object" or "target", place (3,) [m], times [s]."""

    role: str
    place: FloatArray
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Move:
    """A smooth movement between two poses (4, 4); the hand keeps the end pose until the next one begins."""

    start_s: float
    end_s: float
    start: FloatArray
    end: FloatArray
    arch_m: float


@dataclass(frozen=True, slots=True)
class PersonBehaviour:
    """All that the person does; times count from the start of the performance [s].

    samples are mono, 16 kHz, and last for duration_s; words carry the true times; pointing is the truth for scoring.
    """

    samples: npt.NDArray[np.int16]
    words: tuple[SpokenWord, ...]
    duration_s: float
    hand: Hand
    moves: tuple[Move, ...]
    pointing: tuple[Pointing, ...]
    attributes: PersonAttributes

    def hand_at(self, t_s: float) -> FloatArray | None:
        """Return the pose (4, 4) of the hand frame in base_footprint at a time [s], or None while it is away."""
        if not self.moves or not self.moves[0].start_s < t_s < self.moves[-1].end_s:
            return None
        move = next(m for m in reversed(self.moves) if m.start_s <= t_s)
        pose = _interpolated_pose(move, t_s)
        # Nobody holds a hand quite still.
        phases = np.array([7.3, 9.1, 8.2]) * 2.0 * np.pi * t_s
        slow = np.array([0.9, 1.3, 1.1]) * 2.0 * np.pi * t_s + np.array([0.0, 1.0, 2.0])
        pose[:3, 3] += BEHAVIOUR.tremor_m * (0.25 * np.sin(phases) + 0.75 * np.sin(slow))
        if self.attributes.waver > 0.0:
            sway = np.array([0.55, 0.7, 0.45]) * 2.0 * np.pi * t_s + np.array([0.3, 2.0, 4.0])
            pose[:3, 3] += self.attributes.waver * np.sin(sway) * (1.0, 1.0, 0.5)
        return pose


def plan_behaviour(
    say: str,
    targets: Mapping[str, FloatArray],
    obstacles: Sequence[Obstacle],
    table: Table,
    options: PersonOptions,
    rng: np.random.Generator,
    *,
    behaviour_options: BehaviourOptions = BEHAVIOUR,
) -> PersonBehaviour:
    """Plan what the person says and how the hand moves.

    Args:
        say: the sentence.
        targets: places (3,) [m] to point at, by role: "object", "target".
        obstacles: the objects on the table, for the hand to keep clear of.
        table: the table.
        options: the person.
        rng: decides what the options leave open.
        behaviour_options: when to enter, point and leave.

    Raises:
        VoiceError: the voice is not known.
    """
    attributes = draw_attributes(options, rng)
    hand = build_hand(attributes.hand, attributes.size, attributes.skin, attributes.sleeve)
    spoken = speak(say, attributes.voice, attributes.speed, attributes.pitch)
    ranges = _spoken_ranges(spoken.words, targets)
    pointed = {role: targets[role] for role in ranges}
    placements = _placements(hand, pointed, attributes.side, obstacles, table, rng, behaviour_options=behaviour_options)
    attributes = replace(attributes, side=placements[0]) if placements is not None else attributes
    poses = placements[1] if placements is not None else {}
    if len(ranges) > 1:
        short = _move_duration_s(poses["object"], poses["target"]) + attributes.lead + attributes.lag
        short -= spoken.words[ranges["target"][0]].start_s - spoken.words[ranges["object"][1] - 1].end_s
        spoken = insert_pause(spoken, ranges["object"][1] - 1, min(max(short, 0.0), behaviour_options.longest_pause_s))
    first = min((spoken.words[span[0]].start_s for span in ranges.values()), default=1.0)
    unseen_s, enter_s = behaviour_options.unseen_s, behaviour_options.enter_s
    start_s = max(unseen_s + 0.2, unseen_s + enter_s + attributes.lead - first)
    words = tuple(replace(w, start_s=w.start_s + start_s, end_s=w.end_s + start_s) for w in spoken.words)
    moves, pointing = _plan_moves(words, ranges, poses, attributes, behaviour_options=behaviour_options)
    last = max([start_s + spoken.duration_s, *(m.end_s for m in moves)])
    samples = record(spoken, start_s, last + behaviour_options.after_s, attributes.noise, attributes.reverb, rng)
    return PersonBehaviour(samples, words, last + behaviour_options.after_s, hand, moves, pointing, attributes)


def _spoken_ranges(words: Sequence[SpokenWord], targets: Mapping[str, FloatArray]) -> dict[str, tuple[int, int]]:
    """Return the words [first, last) that go with the gesture for each role that is pointed at."""
    spans = find_phrases([word.text for word in words])
    ranges = {
        role: span for role in ("object", "target") if role in targets and (span := getattr(spans, role)) is not None
    }
    # Saying only "this" or "here" with one gesture: the phrase there is goes with the gesture there is.
    if targets and not ranges and (span := spans.object or spans.target) is not None:
        ranges = {next(iter(targets)): span}
    return ranges


def _placements(
    hand: Hand,
    targets: Mapping[str, FloatArray],
    side: str | None,
    obstacles: Sequence[Obstacle],
    table: Table,
    rng: np.random.Generator,
    *,
    behaviour_options: BehaviourOptions = BEHAVIOUR,
) -> tuple[str, dict[str, Placement]] | None:
    """Choose where to stand, and the pose of the hand for every target."""
    if not targets:
        return None
    viewpoint = robot_viewpoint()
    sides = SIDES if side is None else (side,)
    options = {
        s: {role: place_hand(hand, at, s, obstacles, table, viewpoint) for role, at in targets.items()} for s in sides
    }
    costs = {
        s: max(_reach_cost(p, s, table, behaviour_options=behaviour_options) for p in poses.values())
        for s, poses in options.items()
    }
    good = [s for s in sides if costs[s] <= min(costs.values()) + 0.25]
    chosen = good[int(rng.integers(len(good)))]
    return chosen, options[chosen]


def _reach_cost(
    placement: Placement, side: str, table: Table, *, behaviour_options: BehaviourOptions = BEHAVIOUR
) -> float:
    """Cost of a pose for someone who stands at a side of the table: reaching far over it is hard."""
    x, y, _ = placement.target
    reach = {"far": table.x_max - x, "left": table.y_max - y, "right": y - table.y_min}[side]
    return placement.cost + 3.0 * max(float(reach) - behaviour_options.easy_reach_m, 0.0)


def _plan_moves(
    words: Sequence[SpokenWord],
    ranges: Mapping[str, tuple[int, int]],
    poses: Mapping[str, Placement],
    attributes: PersonAttributes,
    *,
    behaviour_options: BehaviourOptions = BEHAVIOUR,
) -> tuple[tuple[Move, ...], tuple[Pointing, ...]]:
    moves: list[Move] = []
    pointing: list[Pointing] = []
    for role, (begin, end) in sorted(ranges.items(), key=lambda item: item[1]):
        pose = poses[role].pose
        arrive = words[begin].start_s - attributes.lead
        if not moves:
            moves.append(
                Move(
                    arrive - behaviour_options.enter_s,
                    arrive,
                    _withdrawn_pose(pose, str(attributes.side), behaviour_options=behaviour_options),
                    pose,
                    0.0,
                )
            )
        else:
            leave = pointing[-1].end_s
            arrive = min(max(arrive, leave + 0.4), words[begin].start_s + max(0.15, -attributes.lead))
            depart = max(leave, arrive - 1.2 * _move_duration_s(poses[pointing[-1].role], poses[role]))
            arch = 0.2 * float(np.linalg.norm(pose[:3, 3] - moves[-1].end[:3, 3]))
            pointing[-1] = replace(pointing[-1], end_s=depart)
            moves.append(Move(depart, arrive, moves[-1].end, pose, arch))
        stay = max(words[end - 1].end_s + attributes.lag, arrive + behaviour_options.shortest_pointing_s)
        pointing.append(Pointing(role, poses[role].target, arrive, stay))
    if moves:
        gone = pointing[-1].end_s + behaviour_options.dwell_s
        pointing[-1] = replace(pointing[-1], end_s=gone)
        moves.append(
            Move(
                gone,
                gone + behaviour_options.leave_s,
                moves[-1].end,
                _withdrawn_pose(moves[-1].end, str(attributes.side), behaviour_options=behaviour_options),
                0.0,
            )
        )
    return tuple(moves), tuple(pointing)


def _move_duration_s(a: Placement, b: Placement) -> float:
    """How long a hand takes from one pose to another: near 1 m/s at its fastest."""
    return 0.35 + 0.7 * float(np.linalg.norm(a.pose[:3, 3] - b.pose[:3, 3]))


def _withdrawn_pose(pose: FloatArray, side: str, *, behaviour_options: BehaviourOptions = BEHAVIOUR) -> FloatArray:
    """Draw a hand back out of the robot's sight, the way the arm came."""
    azimuth = ARM_AZIMUTH[side]
    away = pose.copy()
    away[:3, 3] -= behaviour_options.withdrawal_m * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) - [0.0, 0.0, 0.12]
    return away


def _interpolated_pose(move: Move, t_s: float) -> FloatArray:
    """Minimum-jerk way between two poses."""
    share = float(np.clip((t_s - move.start_s) / max(move.end_s - move.start_s, 1e-6), 0.0, 1.0))
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    pose = np.eye(4)
    ends = Rotation.from_matrix(np.stack([move.start[:3, :3], move.end[:3, :3]]))
    pose[:3, :3] = Slerp([0.0, 1.0], ends)(smooth).as_matrix()
    pose[:3, 3] = (1.0 - smooth) * move.start[:3, 3] + smooth * move.end[:3, 3]
    pose[2, 3] += 4.0 * move.arch_m * smooth * (1.0 - smooth)
    return pose
