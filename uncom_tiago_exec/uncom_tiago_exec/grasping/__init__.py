# SPDX-License-Identifier: Apache-2.0
"""Grasps of objects and poses at which they are released."""
