"""ROS bags of both generations, written by rosbags: axes, stamps, topics, and what is refused."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from swashplate.errors import FlightError, MissingLibraryError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read

BEGIN = 1_700_000_000_000_000_000  # ns
N = 40


def _messages(store: Any, *, ros1: bool) -> list[tuple[str, str, int, Any]]:
    """Poses, inertial data, sticks and a lone number over 0.4 s, with the header 3 ms before the recording."""
    t = store.types
    time, vector, quaternion = (t[f"{n}"] for n in ("builtin_interfaces/msg/Time", "geometry_msgs/msg/Vector3",
                                                    "geometry_msgs/msg/Quaternion"))  # fmt: skip
    point = t["geometry_msgs/msg/Point"]
    out: list[tuple[str, str, int, Any]] = []
    for k in range(N):
        stamp = BEGIN + 10_000_000 * k
        sequence = {"seq": k} if ros1 else {}
        header = t["std_msgs/msg/Header"](
            **sequence, stamp=time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="map"
        )
        half = 0.5 * 0.1  # turned by 0.1 rad about the body's x, forward: rolls right
        q = quaternion(x=np.sin(half), y=0.0, z=0.0, w=np.cos(half))
        pose = t["geometry_msgs/msg/Pose"](position=point(x=1.0, y=2.0, z=3.0 + 0.01 * k), orientation=q)
        out.append(("/mocap/pose", "geometry_msgs/msg/PoseStamped", stamp, (header, pose)))
        level = quaternion(x=0.0, y=0.0, z=0.0, w=0.0)
        imu = t["sensor_msgs/msg/Imu"](
            header=header, orientation=level, orientation_covariance=np.array([-1.0] + [0.0] * 8),
            angular_velocity=vector(x=0.1, y=0.2, z=0.3), angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(x=1.0, y=2.0, z=9.8), linear_acceleration_covariance=np.zeros(9),
        )  # fmt: skip
        out.append(("/imu", "sensor_msgs/msg/Imu", stamp, imu))
        joy = t["sensor_msgs/msg/Joy"](
            header=header, axes=np.array([0.01 * k, -0.5], np.float32), buttons=np.zeros(1, np.int32)
        )
        out.append(("/joy", "sensor_msgs/msg/Joy", stamp, joy))
        out.append(("/rotor/speed", "std_msgs/msg/Float64", stamp, t["std_msgs/msg/Float64"](data=100.0 + k)))
        out.append(("/chatter", "std_msgs/msg/String", stamp, t["std_msgs/msg/String"](data="hello")))
    stamped = t["geometry_msgs/msg/PoseStamped"]
    return [(a, b, c, stamped(header=d[0], pose=d[1]) if isinstance(d, tuple) else d) for a, b, c, d in out]


def _bag1(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(path) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, stamp, message in _messages(store, ros1=True):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp + 3_000_000, store.serialize_ros1(message, kind))
    return path


def _bag2(path: Path, plugin: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(path, version=9, storage_plugin=plugin) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, stamp, message in _messages(store, ros1=False):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp + 3_000_000, store.serialize_cdr(message, kind))
    return path


def _check(flight: Flight) -> None:
    assert_allclose(flight.time("p"), 0.01 * np.arange(N) - 0.003, atol=1e-9)  # the header's time
    assert_allclose(flight.time("rotor_speed"), 0.01 * np.arange(N), atol=1e-9)  # no header: the recording's
    assert_allclose([flight.values(n)[0] for n in "pqr"], [0.1, -0.2, -0.3])
    assert_allclose([flight.values(n)[0] for n in ("ax", "ay", "az")], [1.0, -2.0, -9.8])
    assert_allclose([flight.values(n)[0] for n in "xyz"], [2.0, 1.0, -3.0])  # east 1, north 2, up 3
    assert_allclose(flight.values("stick_1"), 0.01 * np.arange(N), rtol=1e-6)
    # The quaternion turns the nose east (ENU's x) and rolls right by 0.1 rad: yaw 90 degrees in NED.
    w, x, y, z = (flight.values(n)[0] for n in ("qw", "qx", "qy", "qz"))
    assert np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(0.1)
    assert np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(np.pi / 2)
    notes = " ".join(flight.provenance.notes)
    assert flight.epoch == pytest.approx(1_700_000_000.003, abs=1e-6)  # 2023-11-14 22:13:20
    assert "/chatter [std_msgs/msg/String] (40)" in notes
    assert flight.provenance.damage == ()
    assert len(flight.provenance.sha256) == 64


def test_a_rosbag1(tmp_path: Path) -> None:
    _check(read(_bag1(tmp_path / "a.bag")))


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_rosbag2_folder_and_its_single_file(tmp_path: Path, plugin: StoragePlugin) -> None:
    folder = _bag2(tmp_path / "a", plugin)
    _check(read(folder))
    (single,) = (file for file in folder.iterdir() if file.suffix != ".yaml")
    _check(read(single))


@pytest.mark.parametrize("folder", ["what?mode=memory", "fl%41ig#ht"])
@pytest.mark.parametrize("bag", [_bag1, _bag2])
def test_a_folder_of_any_name(bag: Any, folder: str, tmp_path: Path) -> None:
    """SQLite takes the characters for its own: another file would be read, or none."""
    (tmp_path / "written").mkdir()
    name = bag(tmp_path / "written" / "a.bag").name
    _check(read((tmp_path / "written").rename(tmp_path / folder) / name))


def test_other_axes_can_be_given(tmp_path: Path) -> None:
    flight = read(_bag1(tmp_path / "a.bag"), world_axes="north-west-up", body_axes="forward-right-down")
    assert_allclose([flight.values(n)[0] for n in "xyz"], [1.0, -2.0, -3.0])
    assert_allclose([flight.values(n)[0] for n in "pqr"], [0.1, 0.2, 0.3])


def test_two_topics_of_a_kind_get_their_names(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(tmp_path / "a.bag") as writer:
        for name in ("/imu/one", "/imu/two"):
            kind = "sensor_msgs/msg/Imu"
            connection = writer.add_connection(name, kind, typestore=store)
            for topic, _, stamp, message in _messages(store, ros1=True):
                if topic == "/imu":
                    writer.write(connection, stamp, store.serialize_ros1(message, kind))
    flight = read(tmp_path / "a.bag")
    assert {"p", "p_imu_two"} <= set(flight.channels)


def test_a_bag_that_was_not_closed_or_has_nothing_known_is_refused(tmp_path: Path) -> None:
    content = _bag1(tmp_path / "a.bag").read_bytes()
    (tmp_path / "b.bag").write_bytes(content[: len(content) // 2])
    with pytest.raises(FlightError, match=r"b\.bag: does not open as a ROS bag: .*reindex"):
        read(tmp_path / "b.bag")
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(tmp_path / "c.bag") as writer:
        connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        raw = store.serialize_ros1(store.types["std_msgs/msg/String"](data="x"), "std_msgs/msg/String")
        writer.write(connection, BEGIN, raw)
    with pytest.raises(FlightError, match=r"its topics are /chatter \(std_msgs/msg/String\)"):
        read(tmp_path / "c.bag")
    with pytest.raises(FlightError, match="has no meaning for a ROS bag"):
        read(tmp_path / "a.bag", mapping={"rate": 50})
    (tmp_path / "folder").mkdir()
    with pytest.raises(FlightError, match="is a folder"):
        read(tmp_path / "folder")


def test_without_rosbags_the_error_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = _bag1(tmp_path / "a.bag")
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(MissingLibraryError, match=r"needs the library rosbags,.*pip install 'swashplate\[logs\]'"):
        read(bag)


_RUNS = "open('ran', 'w')"


@pytest.mark.parametrize(
    "definition",
    [
        "float64 data",
        f"float64 data\n{_RUNS}",
        f"float64 data\nfloat64 a: {_RUNS}",
        f"float64 data\nfloat64 a;{_RUNS}",
        f"float64 data\nstring A='; {_RUNS}; '",
        f"float64 data\nstring A={_RUNS}",
        f"float64 data\nstring a \"'''; {_RUNS}; '''\"",
        f"float64 data\nfloat64[{_RUNS}] a",
        f'float64 data\n# """\n{_RUNS}\n"""',
        f'float64 data\n"""\n{_RUNS}',
        f"float64 data\n{'=' * 80}\nMSG: a/B'] = {_RUNS} #\nfloat64 x",
        f"float64 data\na/{_RUNS} x",
        "float64 data\nfloat64 __class__\nfloat64 lambda\nstring import",
    ],
)
def test_no_code_in_a_bags_own_words_for_its_messages_runs(definition: str, tmp_path: Path) -> None:
    """rosbags writes Python code from them, and compiles it; the process works in the bag's folder."""
    path = tmp_path / "a.bag"
    with Writer1(path) as writer:
        connection = writer.add_connection("/a", "std_msgs/msg/Float64", msgdef=definition, md5sum="0" * 32)
        for k in range(3):
            writer.write(connection, BEGIN + k * 10_000_000, np.float64(k).tobytes())
    with contextlib.suppress(FlightError):
        read(path)
    assert not (tmp_path / "ran").exists()
