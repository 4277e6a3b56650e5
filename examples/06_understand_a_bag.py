# SPDX-License-Identifier: Apache-2.0
"""A recorded bag through the real nodes: what was heard, and what was meant by it.

Run it with: ./uncom exec python examples/06_understand_a_bag.py [BAG]
"""

import sys
from pathlib import Path

from uncom_bringup.ros.understand_recording import understand_in_process

bag = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "bags" / "which_of_the_bowls.mcap"
result = understand_in_process(bag).reproducible_result()
print("heard     ", result["heard"], f"({result['pictures']} pictures)")
for command in result["commands"]:
    print("understood", command["object"], "-", command["action"], "-", command["target"])
for sentence in result["said"]:
    print("robot says", sentence)
