# SPDX-License-Identifier: Apache-2.0
"""A node whose parameters are the fields of a frozen dataclass, and the main of every node."""

from __future__ import annotations

import dataclasses
import logging
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import NotInitializedException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from uncom_common.exceptions import UncomError
from uncom_common.options import NODE
from uncom_common.parent_process import end_with_named_parent

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

ConfigT = TypeVar("ConfigT", bound="DataclassInstance")


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


class ConfiguredNode(Node, Generic[ConfigT]):
    """A node with `self.config`, read once from its parameters.

    Every field of the configuration class is declared as a parameter of the same name with the field's default
    (a nested default is typed nowhere else); `field(metadata={"description": ...})` becomes its description.
    Tuples are arrays in ROS. The class's own `__post_init__` rejects bad values.
    """

    def __init__(self, name: str, config_class: type[ConfigT], **node_options: Any) -> None:
        """Declare the parameters and gather them in `config`."""
        super().__init__(name, **node_options)
        values: dict[str, Any] = {}
        for field in dataclasses.fields(config_class):
            default = _default(field)
            descriptor = ParameterDescriptor(description=field.metadata.get("description", ""), dynamic_typing=False)
            declared = list(default) if isinstance(default, tuple) else default
            value = self.declare_parameter(field.name, declared, descriptor).value
            values[field.name] = tuple(value) if isinstance(default, tuple) else value
        self.config: ConfigT = config_class(**values)


def run_node(make_node: Callable[[], Node], args: list[str] | None = None, *, niceness: int = 0) -> int:
    """Spin one node until it is told to stop; the body of every node's main. Returns the exit status.

    An UncomError at start is one line on standard error and status 2. One thread is enough, as no callback
    waits, and it is cheap: rclpy's multi-threaded executor takes three times the processor time for each message.

    Args:
        make_node: makes it.
        args: of the command line.
        niceness: above 0 for a node that takes all the processor time it gets, so that it leaves others their own.
    """
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    end_with_named_parent()
    os.nice(niceness)
    rclpy.init(args=args)
    node: Node | None = None
    executor = SingleThreadedExecutor()
    try:
        node = make_node()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except UncomError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    except (RuntimeError, NotInitializedException):
        # Told to stop while it was still starting: what it was just making finds ROS gone.
        if rclpy.ok():
            raise
    finally:
        executor.shutdown(timeout_sec=NODE.shutdown_timeout_s)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
