# SPDX-License-Identifier: Apache-2.0
"""What is seen while a task is carried out: the robot itself, objects again, and whether the task is done."""
