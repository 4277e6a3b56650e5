# SPDX-License-Identifier: Apache-2.0
"""The simulated TIAGo++ as a ROS 2 node: the robot's own topics and actions, and the world's clock and sounds."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from audio_common_msgs.msg import AudioDataStamped, AudioInfo
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import (
    camera_to_msg,
    depth_to_msg,
    header_to_msg,
    rgb_to_msg,
    seconds_from_msg,
    time_to_msg,
)

from uncom_interfaces.msg import SimState
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.driver.driver_config import DriverConfig
from uncom_sim.driver.options import AUDIO
from uncom_sim.driver.real_time import PeriodicSchedule, RealTimePacer
from uncom_sim.driver.ros.conversions import (
    audio_info_to_msg,
    audio_to_msg,
    frames_to_msg,
    joint_state_to_msg,
    odometry_to_msg,
    sim_state_to_msg,
)
from uncom_sim.driver.ros.trajectory_action_server import TrajectoryActionServer
from uncom_sim.robot.description import CAMERA_FRAME, tiago_urdf
from uncom_sim.world.simulator import Simulator

_CAMERA = "/head_front_camera"
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class DriverNode(ConfiguredNode[DriverConfig]):
    """Steps the simulation in a thread of its own and publishes from there; callbacks leave commands in an inbox."""

    def __init__(self, **node_options: Any) -> None:
        """Build the scene and start time.

        Raises:
            UncomError: the scene or the robot's model cannot be used.
        """
        super().__init__("driver_node", DriverConfig, **node_options)
        scene = self.config.scene()
        self._simulator = Simulator(scene, self.config.seed, self.config.simulator_options())
        self._inbox: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._moving: TFMessage | None = None
        self._advertise()
        self._trajectory_servers = [
            TrajectoryActionServer(self, self._simulator, name, self._inbox.put) for name in self._simulator.controllers
        ]
        self.create_subscription(TwistStamped, "/mobile_base_controller/cmd_vel", self._on_velocity, 10)
        self.create_service(Trigger, "/sim/start", self._on_start)
        self._tasks = self._schedules()
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)
        self.get_logger().info(f"simulating scene {scene.name!r}, seed {self.config.seed}")
        self._thread.start()

    def destroy_node(self) -> None:
        """Stop time, then take the node away."""
        self._stopping.set()
        self._thread.join(timeout=10.0)
        for server in self._trajectory_servers:
            server.destroy()
        super().destroy_node()

    def _advertise(self) -> None:
        self._clock_out = self.create_publisher(Clock, "/clock", 10)
        self._joints_out = self.create_publisher(JointState, "/joint_states", 10)
        self._tf_out = self.create_publisher(TFMessage, "/tf", 100)
        self._tf_static_out = self.create_publisher(TFMessage, "/tf_static", _LATCHED)
        self._description_out = self.create_publisher(String, "/robot_description", _LATCHED)
        self._odometry_out = self.create_publisher(Odometry, "/mobile_base_controller/odom", 10)
        self._rgb_out = self.create_publisher(Image, f"{_CAMERA}/rgb/image_raw", 10)
        self._rgb_info_out = self.create_publisher(CameraInfo, f"{_CAMERA}/rgb/camera_info", 10)
        self._depth_out = self.create_publisher(Image, f"{_CAMERA}/depth_registered/image_raw", 10)
        self._depth_info_out = self.create_publisher(CameraInfo, f"{_CAMERA}/depth_registered/camera_info", 10)
        self._audio_out = self.create_publisher(AudioDataStamped, "/audio", 500)
        self._audio_info_out = self.create_publisher(AudioInfo, "/audio_info", _LATCHED)
        self._state_out = self.create_publisher(SimState, "/sim/state", 10)
        self._overview_out = self.create_publisher(Image, "/sim/overview/image_raw", 10)

    def _schedules(self) -> list[tuple[PeriodicSchedule, Callable[[], None]]]:
        """Return what is to be done when, in simulated time; the clock goes first."""
        config, start = self.config, self._simulator.time_s
        tasks: list[tuple[float, Callable[[], None]]] = [
            (config.clock_rate_hz, self._publish_clock),
            (config.joint_state_rate_hz, self._publish_joints),
            (20.0, self._publish_controllers),
            (1.0 / AUDIO.chunk_s, self._publish_audio),
            (10.0, self._publish_state),
            (config.overview_rate_hz, self._publish_overview),
        ]
        self._camera_schedule = PeriodicSchedule(config.camera_rate_hz, start)
        return [(PeriodicSchedule(rate, start), task) for rate, task in tasks if rate > 0.0]

    # --- callbacks: store only ---

    def _on_velocity(self, msg: TwistStamped) -> None:
        self._inbox.put(
            partial(self._drive, seconds_from_msg(msg.header.stamp), msg.twist.linear.x, msg.twist.angular.z)
        )

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._inbox.put(self._simulator.start_person)
        response.success = True
        response.message = "the person begins"
        return response

    # --- the simulation's thread ---

    def _run(self) -> None:
        simulator = self._simulator
        try:
            self._publish_latched()
            pacer = RealTimePacer(self.config.real_time_factor, simulator.time_s)
            while not self._stopping.is_set() and self.context.ok():
                while not self._inbox.empty():
                    self._inbox.get()()
                for server in self._trajectory_servers:
                    server.watch()
                simulator.step()
                self._publish_due()
                pacer.keep(simulator.time_s, self._stopping)
        except Exception as error:
            # Publishing fails when ROS is shut down under our feet; anything else is a fault to be seen.
            if self.context.ok() and not self._stopping.is_set():
                self.get_logger().fatal(f"the simulation stopped: {error!r}")
                raise
        finally:
            simulator.close()

    def _drive(self, stamp_s: float, linear: float, angular: float) -> None:
        now, timeout = self._simulator.time_s, self._simulator.base.config.command_timeout_s
        if stamp_s > 0.0 and now - stamp_s > timeout:
            self.get_logger().warning(
                f"velocity ignored: its stamp is {now - stamp_s:.2f} s old; set use_sim_time on the sender",
                throttle_duration_sec=5.0,
            )
            return
        self._simulator.base.command(linear, angular, now)

    def _publish_latched(self) -> None:
        self._description_out.publish(String(data=tiago_urdf()))
        self._tf_static_out.publish(frames_to_msg(self._simulator.fixed_frames(), self._simulator.time_s))
        self._audio_info_out.publish(audio_info_to_msg())

    def _publish_due(self) -> None:
        now = self._simulator.time_s
        for schedule, task in self._tasks:
            if schedule.due(now):
                task()
        config = self.config
        idle = config.camera_rate_idle_hz > 0.0 and not self._simulator.person_present
        self._camera_schedule.set_rate(config.camera_rate_idle_hz if idle else config.camera_rate_hz, now)
        if self._camera_schedule.due(now):
            self._publish_camera()

    def _publish_clock(self) -> None:
        self._clock_out.publish(Clock(clock=time_to_msg(self._simulator.time_s)))

    def _publish_joints(self) -> None:
        simulator = self._simulator
        self._joints_out.publish(joint_state_to_msg(simulator.joint_state(), simulator.time_s))
        self._moving = frames_to_msg(simulator.moving_frames(), simulator.time_s, self._moving)
        self._tf_out.publish(self._moving)
        self._odometry_out.publish(odometry_to_msg(simulator.base.odometry, simulator.time_s))

    def _publish_controllers(self) -> None:
        for server in self._trajectory_servers:
            server.report()

    def _publish_audio(self) -> None:
        while (chunk := self._simulator.microphone.listen(self._simulator.time_s, AUDIO.chunk_s)) is not None:
            stamp, samples = chunk
            self._audio_out.publish(audio_to_msg(samples, stamp))

    def _publish_state(self) -> None:
        simulator = self._simulator
        contacts = (simulator.contacts.table, simulator.contacts.bystanders)
        words = simulator.world.person.words
        self._state_out.publish(
            sim_state_to_msg(
                simulator.object_states(), words, simulator.time_s, contacts, person_done=simulator.person_done
            )
        )

    def _publish_camera(self) -> None:
        outputs = (self._rgb_out, self._depth_out, self._rgb_info_out, self._depth_info_out)
        if not any(output.get_subscription_count() for output in outputs):
            return
        rgb, depth = self._simulator.render_camera()
        header = header_to_msg(self._simulator.time_s, CAMERA_FRAME)
        info = camera_to_msg(HEAD_CAMERA, header)
        self._rgb_out.publish(rgb_to_msg(rgb, header))
        self._rgb_info_out.publish(info)
        self._depth_out.publish(depth_to_msg(depth, header))
        self._depth_info_out.publish(info)

    def _publish_overview(self) -> None:
        if self._overview_out.get_subscription_count():
            header = header_to_msg(self._simulator.time_s, "overview_camera")
            self._overview_out.publish(rgb_to_msg(self._simulator.render_overview(), header))


def main(args: list[str] | None = None) -> None:
    """Run the node until it is told to stop."""
    sys.exit(run_node(DriverNode, args))


if __name__ == "__main__":
    main()
