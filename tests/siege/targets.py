"""What is besieged: every form of log, record and document, a few whole files of each, and what reads them."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import zlib
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

import made_autopilot_logs
import made_blackbox_logs
import made_logs
import swashplate as sp
from made_results import result
from made_telemetry import telemetry
from swashplate.bench.record_files import is_bench, read_bench
from swashplate.control.draws.variations import draw_models
from swashplate.control.kinds import load_controller, save_controller
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.lqg.design import design
from swashplate.errors import SwashError
from swashplate.export.control_json import control_json, read_linear
from swashplate.export.linear import Linear
from swashplate.filtering.sensor_suite import suite
from swashplate.flights.flight import Flight, stream
from swashplate.flights.growing import Growing
from swashplate.flights.maneuvers.series import parse as maneuver
from swashplate.flights.provenance import Provenance
from swashplate.flights.tabular import write_csv
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.links.servos import servo_mapping
from swashplate.models.linear.expressions import parse_tie

from .more_targets import MORE
from .target import Target, Use, by_bytes, by_entries, by_hdf5, by_matlab


# ---- what reads them ---------------------------------------------------------------------------------------------
def _look(path: Path, **how: Any) -> None:
    """Reads it; some as `swash inspect` does, some go on (conditioned, saved, loaded): a hundred times as long."""
    from swashplate.api.verbs.look import Inspect

    lot = zlib.crc32(path.read_bytes()) % 64 if path.is_file() else 0
    if lot < 4 and not how:
        with contextlib.redirect_stdout(io.StringIO()):
            asked = Inspect([str(path)])
            print(*asked.text(asked.answer(), 80))
    elif lot < 48 or not is_bench(path):
        flight = sp.read(path, **how)
        if lot == 4:
            _go_on(flight)
    else:
        read_bench(path)


def _go_on(flight: Flight) -> None:
    for name in flight.channels[:40]:
        flight.values(name)
    with contextlib.suppress(SwashError):
        flight.condition(rate=20.0, cutoff=4.0)
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(SwashError):
        kept = Flight.load(flight.save(Path(folder) / "kept.nc"))
        assert list(kept.streams) == list(flight.streams)


def _with_flight(beside: str, content: str) -> Use:
    """Reads a mapping file with the table that it is for."""

    def use(path: Path) -> None:
        table = path.with_name(beside)
        table.write_text(content)
        _look(table, mapping=path)

    return use


# ---- whole files -------------------------------------------------------------------------------------------------
def _flight() -> Flight:
    t = np.arange(200) / 50.0
    slow = np.arange(40) / 10.0
    motion = {"phi": 0.1 * np.sin(6 * t), "p": 0.6 * np.cos(6 * t), "x": t, "servo_roll": 0.1 * np.sign(np.sin(t))}
    return Flight(
        {"motion": stream(t, motion), "power": stream(slow, {"voltage": 11.0 - 0.01 * slow})},
        Provenance(source="a test", reader="tests", reader_version="1", simulated=True, vehicle="coax"),
    ).done("simulate", rate=50.0)


def _written(name: str, write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def growing_file(*, rows: int = 200) -> bytes:
    return _written("a.growing", lambda path: _growing(path, rows=rows))


def _growing(path: Path, *, rows: int) -> None:
    flight = _flight()
    motion = flight.streams["motion"]
    empty = Flight({"motion": motion.isel(time=slice(0, 0))}, flight.provenance, flight.history)
    names = [str(name) for name in motion.data_vars]
    with Growing(path, like=empty) as file:
        for t, row in zip(flight.time("p")[:rows], flight.array(names)[:rows], strict=True):
            file.append(float(t), row)


def _responses() -> bytes:
    n, one = 20, np.ones((20, 1, 1))
    response = FrequencyResponse(
        omega=np.arange(1.0, n + 1), inputs=("a",), outputs=("p",), response=one + 0j, coherence=one, error=0.1 * one,
        multiple=one[..., 0], input_power=one[..., 0], output_power=one[..., 0], input_coherence=one,
        input_units=("1",), output_units=("rad/s",), method="x", windows=(), sources=(), warnings=(), problems=(),
        settings={},
    )  # fmt: skip
    return _written("response.nc", response.save)


def _use_responses(path: Path) -> None:
    found = FrequencyResponse.load(path)
    str(found)
    found.to_document()


def _blackbox() -> tuple[bytes, ...]:
    k = np.arange(60)
    moving = {"gyroADC[0]": (100 * np.sin(k / 9)).astype(int), "rcCommand[0]": (50 * np.cos(k / 9)).astype(int)}
    return (made_blackbox_logs.rotorflight(moving), made_blackbox_logs.rotorflight(moving, interval=32) * 2)


def _nanobench() -> bytes:
    t = np.arange(40) * 0.01
    names = "t px py pz qx qy qz qw roll pitch yaw vx vy vz wx_vicon wy_vicon wz_vicon imu_acc_x imu_acc_y imu_acc_z "
    names += "imu_gyro_x imu_gyro_y imu_gyro_z motor_motor_m1 motor_motor_m2 motor_motor_m3 motor_motor_m4 pwr_pm_vbat"
    columns = {name: 0.1 * np.sin(t + k) for k, name in enumerate(names.split())}
    columns |= {"t": 1772681685.5 + t, "qw": np.sqrt(1 - sum(columns[q] ** 2 for q in ("qx", "qy", "qz")))}
    rows = "\n".join(",".join(f"{v:.6f}" for v in row) for row in np.stack(list(columns.values()), axis=1))
    return f"{','.join(columns)}\n{rows}\n".encode()


def _tables() -> tuple[bytes, ...]:
    folder = tempfile.TemporaryDirectory()
    with folder as name:
        own = [path.read_bytes() for path in write_csv(_flight(), Path(name) / "a.csv")]
    rows = "\n".join(f"{0.02 * k:.2f};{np.sin(k):.4f};{k % 5}" for k in range(60))
    return (*own, f"time [s];phi [deg];x [m]\n{rows}\n".encode(), b"time [ms],p,q\n" + b"0,1,2\n20,3,4\n40,5,6\n" * 1)


def _bench() -> tuple[bytes, ...]:
    head = "# swashplate bench record\n# procedure: thrust\n# air_density: 1.2\ntime [s],Fz [N],omega_upper [rpm]\n"
    own = head + "".join(f"{i / 100:.2f},{-1.0 - 0.1 * (i % 9)},{955 + i % 9}\n" for i in range(60))
    return (own.encode(),)


def _linear() -> bytes:
    eye, units = np.eye(2), {"p": "rad/s", "q": "rad/s"}
    names = tuple(units)
    model = Linear("two", "Two", "", -eye, eye, eye, 0 * eye, names, ("a", "b"), names, units, {"a": 0.02})
    return control_json(model).encode()


def _fit_of_vehicle() -> bytes:
    covariance = np.array([[0.01, 0.0008], [0.0008, 0.0001]])
    values, tied = {"tau_f_upper": 1.5, "linkage_lower": 0.13}, {"k_zeta_lower": "linkage_lower"}
    fit = result(sp.vehicle("coax"), values, covariance, corrected=covariance, ties=tied)
    return json.dumps(fit.to_document()).encode()


def _fit_of_model() -> bytes:
    model = _structure()
    values = {name: model.parameters[name].value for name in ("Lb", "Ma")}
    fit = result(model, values, 0.25 * np.array([[1.0, 0.9], [0.9, 1.0]]))
    return json.dumps(fit.to_document()).encode()


def _structure() -> Any:
    return sp.structure("thirteen_state").structure


def _drawn(of: str) -> Use:
    def use(path: Path) -> None:
        str(sp.load(path))
        draw_models(sp.vehicle("coax") if of == "coax" else _structure(), path, count=3, seed=0)

    return use


def _packaged(package: str, *names: str) -> tuple[bytes, ...]:
    return tuple((resources.files("swashplate") / package / name).read_bytes() for name in names)


def _autopilot() -> bytes:
    coax = sp.vehicle("coax")
    return _written("a.toml", lambda path: save_controller(autopilot(coax, sp.trim(coax)), path))


def _lqg() -> bytes:
    made = design(sp.vehicle("coax"), sensors=suite("gyro@50,mocap@50"), rate=50.0)
    return _written("a.toml", lambda path: save_controller(made, path))


def _flown(path: Path) -> None:
    servo_mapping(path, sp.vehicle("raptor50")).inputs([1500.0] * 16, 0.01)


def _stitched() -> bytes:
    vehicle, speeds = sp.vehicle("raptor50"), [0.0, 5.0]
    models = [sp.linearize(vehicle, sp.trim(vehicle, speed=v)).to_structure(name=f"at{int(v)}") for v in speeds]
    return _written("a.toml", sp.stitch(models).save)


def _vehicle(path: Path) -> None:
    str(sp.vehicle(path))


def _line(read: Callable[[str], object]) -> Use:
    return lambda path: read(path.read_bytes().decode("utf-8", errors="replace")[:100_000])


MAPPING = """
delimiter = ","
[channels]
time = {column = "t", unit = "ms"}
phi = {column = "roll", unit = "deg", factor = -1.0}
x = {column = 3, unit = "mm"}
"""
TABLE = "\n".join(["t,roll,x", *(f"{20 * k},{np.sin(k)},{k % 7}" for k in range(100))])
VICON_ROWS = [f"{k},0,{0.01 * k},0,0,{k},1,1" for k in range(1, 60)]
MOTIVE_ROWS = [f"{k},{0.01 * k:.2f},0,0,0,1,{0.1 * k},2,3,0,0,0,0" for k in range(60)]
MANEUVERS = (b"sweep:pitch,0.5-8Hz,34s", b"multisine:roll+pitch,0.4-4Hz,8s,0.1", b"doublet:roll,1s,0.1", b"3211:yaw,1s")
EXPRESSIONS = (b"x = 2 * a + b / (c - 1.5)", b"y = -a*(b + 3e-2)/4", b"z = tau_f")


def _rows(count: int) -> list[made_autopilot_logs.Row]:
    return made_autopilot_logs.ardupilot_rows()[:count]


def _logs(whole: Callable[[], tuple[bytes, ...]], suffix: str, how: Any = by_bytes) -> Callable[[], Target]:
    return lambda: Target(suffix, whole(), how, _look)


def _documents(form: str, whole: Callable[[], tuple[bytes, ...]], use: Use) -> Callable[[], Target]:
    return lambda: Target(f".{form}", whole(), by_entries(form), use)


def _texts(whole: tuple[bytes, ...], read: Callable[[str], object]) -> Callable[[], Target]:
    return lambda: Target(".txt", whole, by_bytes, _line(read))


def saved_mat(*, compressed: bool, n: int = 40) -> bytes:
    return _written("a.mat", lambda path: made_logs.write_coax(path, compressed=compressed, n=n))


TARGETS: Mapping[str, Callable[[], Target]] = {
    "ArduPilot log": _logs(lambda: (made_autopilot_logs.dataflash(_rows(120)),), ".bin"),
    "ArduPilot log, text": _logs(lambda: (made_autopilot_logs.dataflash_text(_rows(120)).encode(),), ".log"),
    "PX4 log, old form": _logs(
        lambda: (made_autopilot_logs.dataflash(made_autopilot_logs.px4_rows(20), made_autopilot_logs.PX4LOG),),
        ".px4log",
    ),
    "telemetry": _logs(lambda: (_written("a.tlog", lambda path: telemetry(path, seconds=3.0)),), ".tlog"),
    "PX4 ULog": _logs(lambda: (made_autopilot_logs.ulog(15), made_autopilot_logs.ulog(15, dropout=True)), ".ulg"),
    "Blackbox log": _logs(_blackbox, ".bbl"),
    "ROS bag, first form": _logs(lambda: bags(1), ".bag"),
    "ROS bag, second form": lambda: Target("", bags(2), by_bytes, look_at_bag),
    "CoaX .mat": _logs(lambda: (saved_mat(compressed=True), saved_mat(compressed=False)), ".mat", by_matlab),
    "netCDF flight": _logs(lambda: (_written("a.nc", _flight().save),), ".nc", by_hdf5),
    "growing recording": _logs(lambda: (growing_file(),), ".growing"),
    "NanoBench CSV": _logs(lambda: (_nanobench(),), ".csv"),
    "Vicon export": _logs(lambda: (made_logs.vicon(VICON_ROWS).encode(),), ".csv"),
    "OptiTrack export": _logs(lambda: (made_logs.motive(MOTIVE_ROWS).encode(),), ".csv"),
    "CSV": _logs(_tables, ".csv"),
    "bench record": _logs(_bench, ".csv"),
    "CSV map": _documents("toml", lambda: (MAPPING.encode(),), _with_flight("table.csv", TABLE)),
    "frequency responses": lambda: Target(".nc", (_responses(),), by_hdf5, _use_responses),
    "card of a coaxial": _documents("toml", lambda: _packaged("models/data", "coax.toml"), _vehicle),
    "card of a helicopter": _documents("toml", lambda: _packaged("models/data", "raptor50.toml"), _vehicle),
    "structure": _documents("toml", lambda: _packaged("models/linear/structures", "thirteen_state.toml"), _vehicle),
    "stitched model": _documents("toml", lambda: (_stitched(),), _vehicle),
    "autopilot": _documents("toml", lambda: (_autopilot(),), load_controller),
    "LQG": _documents("toml", lambda: (_lqg(),), load_controller),
    "servo map": _documents("toml", lambda: _packaged("links/mappings", "raptor50.toml"), _flown),
    "fit of a vehicle": _documents("json", lambda: (_fit_of_vehicle(),), _drawn("coax")),
    "fit of a model": _documents("json", lambda: (_fit_of_model(),), _drawn("structure")),
    "linear model": _documents("json", lambda: (_linear(),), read_linear),
    "maneuver": _texts(MANEUVERS, maneuver),
    "expression": _texts(EXPRESSIONS, parse_tie),
    **MORE,
}
"""By name, made when asked for: some take seconds."""


def bags(
    generation: int, *, plugin: str = "MCAP", kind: str = "geometry_msgs/msg/PoseStamped", count: int = 40
) -> tuple[bytes, ...]:
    """A bag of one topic; of the second form its metadata and its file, with a mark between them: `look_at_bag`."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if generation == 1 else Stores.ROS2_HUMBLE)
    types = store.types
    sequence = {"seq": 0} if generation == 1 else {}
    serialize = store.serialize_ros1 if generation == 1 else store.serialize_cdr

    def message(k: int) -> Any:
        if kind.startswith("std_msgs"):
            return types[kind](data=float(k))
        time = types["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=10_000_000 * k)
        header = types["std_msgs/msg/Header"](**sequence, stamp=time, frame_id="map")
        turned = types["geometry_msgs/msg/Quaternion"](x=0.05, y=0.0, z=0.0, w=0.99875)
        place = types["geometry_msgs/msg/Point"](x=1.0, y=2.0, z=3.0 + 0.01 * k)
        return types[kind](header=header, pose=types["geometry_msgs/msg/Pose"](position=place, orientation=turned))

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bag"
        made = Writer1(path) if generation == 1 else Writer2(path, version=9, storage_plugin=StoragePlugin[plugin])
        with made as writer:
            connection = writer.add_connection("/mocap/pose", kind, typestore=store)
            for k in range(count):
                writer.write(connection, 1_700_000_000_000_000_000 + 10_000_000 * k, serialize(message(k), kind))
        if generation == 1:
            return (path.read_bytes(),)
        # one blob of both files of the folder, which `look_at_bag` takes apart again
        files = {file.name: file.read_bytes() for file in sorted(path.iterdir())}
        return (BAG_MARK.join([files["metadata.yaml"], next(c for n, c in files.items() if n != "metadata.yaml")]),)


BAG_MARK = b"\n--bag--\n"


def look_at_bag(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        _look(bag_folder(path.read_bytes(), Path(name)))


def bag_folder(content: bytes, beside: Path) -> Path:
    """The folder of a bag of the second form, from the one blob that `bags` makes of it."""
    head, mark, tail = content.partition(BAG_MARK)
    folder = beside / "bag"
    folder.mkdir(exist_ok=True)
    (folder / "metadata.yaml").write_bytes(head)
    if mark:
        (folder / "a.bag.mcap").write_bytes(tail)
    return folder
