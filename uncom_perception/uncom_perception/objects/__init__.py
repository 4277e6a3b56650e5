# SPDX-License-Identifier: Apache-2.0
"""Objects on a table, found and named; importing this loads no models."""

from uncom_perception.objects.detectors.detect_in_image import detect_in_image, scene_to_json

__all__ = ["detect_in_image", "scene_to_json"]
