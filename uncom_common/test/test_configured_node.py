# SPDX-License-Identifier: Apache-2.0
from dataclasses import dataclass, field

import pytest
import rclpy
from rclpy.parameter import Parameter
from uncom_common.configured_node import ConfiguredNode
from uncom_common.exceptions import InvalidConfigError


@dataclass(frozen=True)
class Config:
    rate_hz: float = field(default=8.0, metadata={"description": "how often"})
    names: tuple[str, ...] = ("a", "b")

    def __post_init__(self):
        if self.rate_hz <= 0:
            raise InvalidConfigError("rate_hz", self.rate_hz, "must be positive")


@pytest.fixture
def context():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=11)
    yield context
    rclpy.try_shutdown(context=context)


def test_fields_are_parameters_with_the_defaults_of_the_class(context):
    node = ConfiguredNode("n", Config, context=context)
    assert node.config == Config()
    assert node.describe_parameter("rate_hz").description == "how often"


def test_given_parameters_reach_the_configuration(context):
    overrides = [Parameter("rate_hz", value=2.0), Parameter("names", value=["x"])]
    node = ConfiguredNode("n", Config, context=context, parameter_overrides=overrides)
    assert node.config == Config(2.0, ("x",))


def test_bad_values_are_refused_by_the_class(context):
    with pytest.raises(InvalidConfigError, match="rate_hz"):
        ConfiguredNode("n", Config, context=context, parameter_overrides=[Parameter("rate_hz", value=-1.0)])
