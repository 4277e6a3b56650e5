# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of torso and arm, and straight motions of the hand."""
