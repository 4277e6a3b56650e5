# SPDX-License-Identifier: Apache-2.0
"""What every object detector offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import HandsFrame, Scene


class ObjectDetector(ABC):
    """Finds objects in an image and says how well each phrase fits each of them."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Back end and weights, as told in every result."""

    @abstractmethod
    def detect(self, frame: RgbdFrame, phrases: Sequence[str], hands: HandsFrame | None = None) -> Scene:
        """Return what is seen in an image, with its stamp and the name of the frame that geometry is in.

        Args:
            frame: image, with depth and camera where geometry is wanted.
            phrases: noun phrases, one query each; "objects" fits everything, "table" the table.
            hands: hands seen in the same image; they and their forearms are no objects.
        """
