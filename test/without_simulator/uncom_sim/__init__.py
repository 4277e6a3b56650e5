# SPDX-License-Identifier: Apache-2.0
"""Stands in for the simulator on a robot, which has none: first on the path, it makes every import of it fail."""

raise ModuleNotFoundError("there is no simulator here: unit tests of the packages run without it")
