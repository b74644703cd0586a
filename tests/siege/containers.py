"""Small whole files of every container, and what takes one apart: the parser alone, without a flight made of it."""

from __future__ import annotations

import functools
import io
import sqlite3
import tempfile
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import savemat

import made_autopilot_logs
import made_blackbox_logs
import made_logs
import swashplate as sp
from made_telemetry import telemetry
from swashplate.api.campaigns.result_files import ENDING, unpacked
from swashplate.errors import FlightError
from swashplate.flights import growing
from swashplate.flights.foreign_process import JOBS
from swashplate.flights.readers import (
    blackbox_header,
    dataflash,
    dataflash_index,
    dataflash_text,
    mat,
    tlog,
    ulog_messages,
)
from swashplate.flights.readers.blackbox_frames import find_frames
from swashplate.flights.readers.blackbox_header import read_header
from swashplate.flights.readers.blackbox_values import main_frames
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.ulog_topics import Topics

from . import forged, targets
from .forged import Mutate, by_records
from .more_targets import stored_result, use_result
from .target import Use

Take = Callable[[bytes, Path], object]


@dataclass(frozen=True)
class Container:
    """A kind of container.

    Attributes:
        suffix: of a file's name.
        whole: small files.
        take: the parser, from a file's bytes and its path to what tells one outcome from another.
        use: the whole reader, from a path.
        forge: how its records are changed so that the lengths around them are right.
        job: the parser is another's library and runs in the process with limits.
        caught: whether the reader turns whatever the parser raises into words, except for a lack of memory.
    """

    suffix: str
    whole: tuple[bytes, ...]
    take: Take
    use: Use
    forge: Mutate | None = None
    job: bool = False
    caught: bool = False

    def told(self, error: Exception) -> bool:
        """Whether the reader says in words what its parser raises."""
        return self.job or (self.caught and not isinstance(error, MemoryError))


# ---- parsers ------------------------------------------------------------------------------------------------------
def _refuse_unknown(known: bool) -> None:
    if not known:
        raise FlightError("is no such container.")


def _dataflash(content: bytes, path: Path) -> object:
    _refuse_unknown(dataflash_index.is_dataflash(content))
    return _messages(dataflash.messages(content))


def _dataflash_text(content: bytes, path: Path) -> object:
    text = Source(path, content).text
    _refuse_unknown(dataflash_text.is_dataflash_text(text))
    return _messages(dataflash_text.messages(text or ""))


def _messages(found: dataflash.Messages) -> object:
    for table in found.tables.values():
        for name in table.columns:
            table.number(name)
        table.rows(np.zeros(len(table), dtype=np.bool_))
    return sorted(found.tables), len(found.notes), len(found.damage)


def _ulog(content: bytes, path: Path) -> object:
    _refuse_unknown(content.startswith(ulog_messages.MAGIC))
    log = Topics(content, str(path))
    return log.lost > 0, log.unfinished > 0, log.log.file_corruption, sorted({topic.name for topic in log.topics})


def _blackbox(content: bytes, path: Path) -> object:
    starts = blackbox_header.starts(content)
    _refuse_unknown(bool(starts))
    header = read_header(content, starts[0], (*starts, len(content))[1], where=str(path))
    frames = find_frames(content, header, stop=len(content), where=str(path))
    main = main_frames(frames, header)
    return sorted(header.layouts), len(main.time), frames.ended, frames.places, len(main.damage), sorted(frames.others)


def _mat(content: bytes, path: Path) -> object:
    return _kinds(mat.load(Source(path, content)))


def _kinds(value: Any) -> Any:
    if isinstance(value, dict):
        return [(type(key).__name__, _kinds(inner)) for key, inner in value.items()]
    return value.dtype.kind + str(value.ndim) if isinstance(value, np.ndarray) else type(value).__name__


def _tlog(content: bytes, path: Path) -> object:
    source = Source(path, content)
    _refuse_unknown(tlog.recognises(source))
    tables = tlog.tables_of(source)
    return sorted((name, len(table.columns), len(tlog.number_columns(table))) for name, table in tables.items())


def _growing(content: bytes, path: Path) -> object:
    flight = growing.parse(content, where=str(path))
    return len(flight.channels), len(flight.provenance.damage)


def _archive(content: bytes, path: Path) -> object:
    return _kinds(unpacked(content, task="task"))


def _table(content: bytes, path: Path) -> object:
    flight = sp.read(path)
    return flight.provenance.reader, len(flight.channels), len(flight.provenance.damage), len(flight.provenance.notes)


@functools.cache
def _quick_bags() -> None:
    """`rosbags` writes and compiles code for each type of each bag: the same text is compiled once."""
    for part in (import_module("rosbags.serde.cdr"), import_module("rosbags.serde.ros1")):
        compiled = functools.lru_cache(2000)(lambda *lines, of=part.compile_lines: of(list(lines)))
        part.compile_lines = lambda lines, compiled=compiled: compiled(*lines)


def _job(job: str, **asked: Any) -> Take:
    def take(content: bytes, path: Path) -> object:
        _quick_bags()
        said = []
        for told, values in import_module(JOBS[job]).frames(path, **asked):
            assert len(values) == told.get("bytes", 0)
            said.append(sorted(told))
        return said

    return take


# ---- whole files --------------------------------------------------------------------------------------------------
def _logs() -> tuple[bytes, ...]:
    rows = made_autopilot_logs.ardupilot_rows(rate=5.0)
    few = [row for row in rows if row[0] in ("MSG", "MODE", "RATE", "PARM")][:9]
    more = [row for row in rows if row[0] in ("IMU", "ATT", "RCOU", "SIDD", "EV")][:12]
    made = [
        made_autopilot_logs.dataflash(some, {name: made_autopilot_logs.ARDUPILOT[name] for name, _ in some})
        for some in (few, more)
    ]
    return (*made, made_autopilot_logs.dataflash(made_autopilot_logs.px4_rows(3), made_autopilot_logs.PX4LOG))


def _texts() -> tuple[bytes, ...]:
    rows = made_autopilot_logs.ardupilot_rows(rate=5.0)[:12]
    formats = {name: made_autopilot_logs.ARDUPILOT[name] for name, _ in rows}
    return (made_autopilot_logs.dataflash_text(rows, formats).encode(),)


def _blackboxes() -> tuple[bytes, ...]:
    k = np.arange(6)
    return (made_blackbox_logs.rotorflight({"gyroADC[0]": 100 * k, "rcCommand[0]": 50 - k}),)


def _telemetry() -> tuple[bytes, ...]:
    with tempfile.TemporaryDirectory() as folder:
        made = (telemetry(Path(folder) / f"{version}.tlog", seconds=0.2, version=version) for version in (1, 2))
        return tuple(path.read_bytes() for path in made)


def _mats(*, packed: bool) -> tuple[bytes, ...]:
    file = io.BytesIO()
    t = np.arange(4) * 0.02
    fields = {"time": t, "s": {"p": t * 2, "text": "a", "c": np.array([1 + 2j])}, "cell": np.array([t, "b"], object)}
    savemat(file, fields, do_compression=packed)
    return (file.getvalue(), targets.saved_mat(compressed=packed, n=3))


def _hdf5(*, matlab: bool) -> tuple[bytes, ...]:
    file = io.BytesIO()
    with h5py.File(file, "w", libver="earliest" if matlab else "latest") as opened:
        opened.attrs["mark"] = "x"
        opened["time"] = np.arange(4) * 0.02
        opened["time"].attrs["MATLAB_class"] = b"double"
        opened.create_group("s").create_dataset("p", data=np.arange(8.0).reshape(2, 4), chunks=(1, 4), compression=1)
        opened["s/text"] = "a text"
    return ((b"MATLAB 7.3 MAT-file".ljust(512, b"\0") if matlab else b"") + file.getvalue(),)


def _csv() -> tuple[bytes, ...]:
    motive = made_logs.motive([f"{k},{0.01 * k:.2f},0,0,0,1,{0.1 * k},2,3,0,0,0,0" for k in range(3)]).encode()
    vicon = made_logs.vicon([f"{k},0,{0.01 * k},0,0,{k},1,1" for k in range(1, 4)]).encode()
    own = b"time [s],phi [deg],x [m]\n0,1,2\n0.02,1.5,2.5\n0.04,2,3\n"
    bars = b"  real,time | p,rad/s | roll,_deg |\n 0.0 | 1.0 | 2.0 |\n 0.1 | 1.5 | 2.5 |\n 0.2 | 1.0 | 2.0 |\n"
    return (
        own,
        own.replace(b",", b";").replace(b".", b","),
        bars,
        b"t\tp\tq\n0\t1\t2\n20\t3\t4\n40\t5\t6\n",
        motive,
        vicon,
    )


def _bags(generation: int, plugin: str = "MCAP") -> tuple[bytes, ...]:
    (whole,) = targets.bags(generation, plugin=plugin, kind="std_msgs/msg/Float64", count=3)
    whole = whole.partition(targets.BAG_MARK)[2] if generation == 2 else whole
    return (_small_pages(whole) if plugin == "SQLITE3" else whole,)


def _small_pages(content: bytes) -> bytes:
    """A database in pages of 512 bytes."""
    with closing(sqlite3.connect(":memory:")) as old, closing(sqlite3.connect(":memory:")) as new:
        old.deserialize(content)
        new.execute("PRAGMA page_size = 512")
        new.executescript("".join(old.iterdump()))
        return new.serialize()


def _of(suffix: str, whole: Callable[[], tuple[bytes, ...]], take: Take, **more: Any) -> Callable[[], Container]:
    return functools.partial(_made, suffix, whole, take, **more)


def _made(suffix: str, whole: Callable[[], tuple[bytes, ...]], take: Take, **more: Any) -> Container:
    return Container(suffix, whole(), take, **{"use": sp.read, **more})


CONTAINERS: Mapping[str, Callable[[], Container]] = {
    "DataFlash": _of(".bin", _logs, _dataflash, forge=by_records(forged.split_dataflash, forged.join_dataflash)),
    "DataFlash, text": _of(".log", _texts, _dataflash_text),
    "ULog": _of(
        ".ulg",
        lambda: (made_autopilot_logs.ulog(2), made_autopilot_logs.ulog(2, dropout=True)),
        _ulog,
        forge=by_records(forged.split_ulog, forged.join_ulog),
    ),
    "Blackbox": _of(".bbl", _blackboxes, _blackbox, forge=forged.by_header_lines),
    "tables of text": _of(".csv", _csv, _table),
    "MATLAB, level 5": _of(
        ".mat",
        lambda: _mats(packed=False),
        _mat,
        forge=by_records(forged.split_matlab, forged.join_matlab),
    ),
    "MATLAB, level 5, packed (zlib)": _of(".mat", lambda: _mats(packed=True), _mat, forge=forged.by_packed),
    "MATLAB 7.3 (HDF5)": _of(".mat", lambda: _hdf5(matlab=True), _job("hdf5", wanted=""), job=True),
    "netCDF (HDF5)": _of(".nc", lambda: _hdf5(matlab=False), _job("hdf5", wanted="mark"), job=True),
    "telemetry (MAVLink)": _of(".tlog", _telemetry, _tlog, forge=by_records(forged.split_tlog, forged.join_tlog)),
    "growing recording": _of(
        ".growing", lambda: (targets.growing_file(rows=6),), _growing, forge=forged.by_growing_head
    ),
    "ROS bag, first form": _of(
        ".bag",
        lambda: _bags(1),
        _job("rosbag"),
        forge=by_records(forged.split_bag1, forged.join_bag1),
        job=True,
    ),
    "MCAP": _of(
        ".mcap", lambda: _bags(2), _job("rosbag"), forge=by_records(forged.split_mcap, forged.join_mcap), job=True
    ),
    "SQLite bag": _of(".db3", lambda: _bags(2, "SQLITE3"), _job("rosbag"), forge=forged.by_sqlite, job=True),
    "bag's folder (YAML, MCAP)": _of(
        "",
        lambda: targets.bags(2, kind="std_msgs/msg/Float64", count=3),
        lambda content, path: _job("rosbag", disk=1 << 24)(content, targets.bag_folder(content, path.parent)),
        use=targets.look_at_bag,
        forge=forged.by_metadata(targets.BAG_MARK),
        job=True,
    ),
    "NumPy's archive (zip)": _of(ENDING, lambda: (stored_result(),), _archive, use=use_result, caught=True),
}
"""By name, made when asked for. gzip and xz: no reader opens them (tests/unit/flights/test_no_log.py)."""
