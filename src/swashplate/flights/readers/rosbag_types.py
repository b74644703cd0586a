"""Messages of ROS whose numbers are read: by type, from a message to numbers by (vector) channel."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Row = dict[str, float]


def _vector(prefix: str, v: Any) -> Row:
    return {f"{prefix}{axis}": float(getattr(v, axis)) for axis in "xyz"}


def _turn(q: Any) -> Row:
    return {f"q{axis}": float(getattr(q, axis)) for axis in "wxyz"}


def _imu(m: Any) -> Row:
    row = {**_vector("rate_", m.angular_velocity), **_vector("force_", m.linear_acceleration)}
    absent = len(m.orientation_covariance) and m.orientation_covariance[0] == -1.0
    return row if absent else {**row, **_turn(m.orientation)}


def _pose(m: Any) -> Row:
    pose = getattr(m.pose, "pose", m.pose)
    return {**_vector("position_", pose.position), **_turn(pose.orientation)}


def _odometry(m: Any) -> Row:
    twist = m.twist.twist
    return {**_pose(m), **_vector("velocity_", twist.linear), **_vector("rate_", twist.angular)}


def _transform(m: Any) -> Row:
    return {**_vector("position_", m.transform.translation), **_turn(m.transform.rotation)}


def _listed(name: str, values: Any, start: int = 1) -> Row:
    return {f"{name}_{i}": float(value) for i, value in enumerate(values, start)}


_LONGEST = 32
"""Numbers of a row that is taken number by number: a longer one is a picture or a scan."""


def every_number(message: Any, above: str = "") -> Row:
    """Numbers of a message by their fields (`pose.position.x`, `channels[0]`), without header and covariances."""
    row: Row = {}
    for field in dataclasses.fields(message):
        name = field.name
        value, path = getattr(message, name), f"{above}{name}"
        if name == "header" or name.endswith("covariance"):
            continue
        if dataclasses.is_dataclass(value):
            row |= every_number(value, f"{path}.")
        elif isinstance(value, int | float):
            row[path] = float(value)
        elif (
            isinstance(value, np.ndarray) and value.ndim == 1 and value.size <= _LONGEST and value.dtype.kind in "fiub"
        ):
            row |= {f"{path}[{k}]": float(one) for k, one in enumerate(value.tolist())}
    return row


_MIXER = ("mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective")
# message type -> its numbers by (vector) channel; "value" takes the topic's name.
TYPES: Mapping[str, Callable[[Any], Row]] = {
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/PoseStamped": _pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose,
    "geometry_msgs/msg/TransformStamped": _transform,
    "nav_msgs/msg/Odometry": _odometry,
    "sensor_msgs/msg/Joy": lambda m: _listed("stick", m.axes),
    "sensor_msgs/msg/BatteryState": lambda m: {"voltage": float(m.voltage), "current": float(m.current)},
    "mavros_msgs/msg/RCIn": lambda m: _listed("rcin", m.channels),
    "mavros_msgs/msg/RCOut": lambda m: _listed("rcout", m.channels),
    "mavros_msgs/msg/ActuatorControl": lambda m: dict(zip(_MIXER, map(float, m.controls), strict=False)),
    "std_msgs/msg/Float32": lambda m: {"value": float(m.data)},
    "std_msgs/msg/Float64": lambda m: {"value": float(m.data)},
    "std_msgs/msg/Float32MultiArray": lambda m: _listed("value", m.data),
    "std_msgs/msg/Float64MultiArray": lambda m: _listed("value", m.data),
}
