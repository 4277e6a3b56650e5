# SPDX-License-Identifier: Apache-2.0
"""Hands and pointing rays; the models are loaded at the first picture, not at import."""

from uncom_perception.hands.point_in_image import hands_to_json, point_in_image

__all__ = ["hands_to_json", "point_in_image"]
