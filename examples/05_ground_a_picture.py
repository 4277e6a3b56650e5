# SPDX-License-Identifier: Apache-2.0
"""Pictures with a pointing hand and a sentence to one object and one place, with the reasons.

A simulated person is filmed while pointing; what was said is given as text with its word times. No ROS is involved.

Run it with: ./uncom exec python examples/05_ground_a_picture.py
"""

import math

from uncom_bringup.chain.chain import Chain
from uncom_language.parser import parse_transcript
from uncom_sim.bench_understanding.judging.ablations import true_transcript
from uncom_sim.bench_understanding.takes.take_planning import plan_takes
from uncom_sim.bench_understanding.takes.take_synthesis import make_take

plan = plan_takes(seed=4, numbers=(1,), takes=1)[0]
take = make_take(plan)  # colour and depth images, camera, transforms, and the words with their times
commands = parse_transcript(true_transcript(take))

chain = Chain()  # loads hand detector, object detector and reasoner with the nodes' own parameters
hands = chain.detect_hands(take, until_s=max(map(chain.needed_until_s, commands)))
pointing = sum(any(hand.pointing for hand in frame.hands) for frame in hands)
print(f'"{plan.scene.say}" ({pointing} images with a pointing hand)')

for grounding in chain.ground_all(take, commands, hands):
    result = grounding.decision.grounded
    print("status", result.status.name.lower(), result.reason)
    for role, candidates in (("object", result.object_candidates), ("target", result.target_candidates)):
        print(role)
        for candidate in sorted(candidates, key=lambda candidate: -candidate.probability)[:4]:
            factors = ", ".join(f"{factor.name} x{math.exp(factor.log):.2g}" for factor in candidate.factors)
            mark = "->" if candidate.chosen else "  "
            print(f"  {mark} {candidate.label:16} p={candidate.probability:.2f}  ({factors})")
