# SPDX-License-Identifier: Apache-2.0
"""An action client that may be used beside the executor's thread.

rclpy notes a request only after sending it (https://github.com/ros2/rclpy/issues/1123): a quick server's answer can be
read in between by the executor, is thrown away, and the future never completes. Here answers wait until the request
is noted. Later versions of rclpy do the same themselves.
"""

from __future__ import annotations

import threading
from typing import Any

from rclpy.action import ActionClient


class RaceFreeActionClient(ActionClient):
    """ActionClient whose answers are handled only when the requests they belong to are known."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Take what ActionClient takes."""
        self._sending = threading.RLock()
        super().__init__(*arguments, **options)

    def send_goal_async(self, *arguments: Any, **options: Any) -> Any:
        """Send a goal; see ActionClient."""
        with self._sending:
            return super().send_goal_async(*arguments, **options)

    def _get_result_async(self, goal_handle: Any) -> Any:
        with self._sending:
            return super()._get_result_async(goal_handle)

    def _cancel_goal_async(self, goal_handle: Any) -> Any:
        with self._sending:
            return super()._cancel_goal_async(goal_handle)

    async def execute(self, taken_data: Any) -> None:
        """Handle answers that the executor has read, once no request is half sent."""
        with self._sending:
            pass
        await super().execute(taken_data)
