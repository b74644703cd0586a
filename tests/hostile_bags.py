"""ROS bags that somebody made to do harm: each is small, and takes gigabytes, or time without an end."""

from __future__ import annotations

import bz2
import os
import sqlite3
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from unittest import mock

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.rosbag2.reader import zstd
from rosbags.typesys import Stores, get_typestore

BOMB = 600 << 20
"""Bytes that each bomb unpacks to: twice what a file of its size may take."""
_NUMBER = "std_msgs/msg/Float64"
ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT {} FROM n"


@cache
def _zeros(of: str) -> bytes:
    """Some kilobytes that unpack to `BOMB` zeros: packed pieces one after the other are one packed whole."""
    piece = 8 << 20
    return (bz2.compress if of == "bz2" else zstd.compress)(bytes(piece)) * (BOMB // piece)


def bzip2_bag(folder: Path) -> Path:
    """A chunk of a bag of the first form: its messages, and zeros."""
    path, store = folder / "bomb.bag", get_typestore(Stores.ROS1_NOETIC)
    with mock.patch("rosbags.rosbag1.writer.bz2_compress", lambda data, level: bz2.compress(data) + _zeros("bz2")):
        writer = Writer1(path)
        writer.set_compression(Writer1.CompressionFormat.BZ2)
        with writer:
            connection = writer.add_connection("/a", _NUMBER, typestore=store)
            for k in range(3):
                message = store.types[_NUMBER](data=float(k))
                writer.write(connection, 10**9 + k, store.serialize_ros1(message, _NUMBER))
    return path


def packed_bag(folder: Path) -> Path:
    """A good one, whose file is packed."""
    return _second(folder, StoragePlugin.SQLITE3, CompressionMode.FILE, name="packed")


def _second(folder: Path, plugin: StoragePlugin, mode: CompressionMode, *, name: str = "bomb") -> Path:
    path, store = folder / name, get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer2(path, version=9, storage_plugin=plugin)
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/a", _NUMBER, typestore=store)
        for k in range(3):
            message = store.types[_NUMBER](data=float(k))
            writer.write(connection, 10**9 + k, store.serialize_cdr(message, _NUMBER))
    return path


def zstandard_mcap(folder: Path) -> Path:
    """A chunk of an MCAP file."""
    packed, zeros = zstd.compress, _zeros("zstd")
    with mock.patch("rosbags.rosbag2.storage_mcap.zstd.compress", lambda data, *_: packed(data) + zeros):
        bag = _second(folder, StoragePlugin.MCAP, CompressionMode.STORAGE)
    (path,) = bag.glob("*.mcap")
    return path


def zstandard_messages(folder: Path) -> Path:
    """Each message of a bag."""
    packed, zeros = zstd.compress, _zeros("zstd")
    with mock.patch("rosbags.rosbag2.writer.zstd.compress", lambda data: packed(data) + zeros):
        return _second(folder, StoragePlugin.SQLITE3, CompressionMode.MESSAGE)


def zstandard_file(folder: Path) -> Path:
    """A file of a bag, which the library unpacks onto the disk."""
    bag = _second(folder, StoragePlugin.SQLITE3, CompressionMode.FILE)
    (path,) = bag.glob("*.zstd")
    path.write_bytes(path.read_bytes() + _zeros("zstd"))
    return bag


def _with_metadata(folder: Path, more: str) -> Path:
    bag = _second(folder, StoragePlugin.SQLITE3, CompressionMode.NONE)
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text() + more)
    return bag


def long_metadata(folder: Path) -> Path:
    """A megabyte of YAML."""
    return _with_metadata(folder, "more:\n" + "".join(f"  - [{k}, {k}, {{a: b}}]\n" for k in range(40_000)))


def anchors(folder: Path) -> Path:
    """YAML with a form of compression that is a list of lists of lists: 10^9 names in 500 bytes."""
    bag = _second(folder, StoragePlugin.SQLITE3, CompressionMode.NONE)
    metadata = bag / "metadata.yaml"
    layers = "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 9))
    text = metadata.read_text().replace("compression_format: ''", "compression_format: *a8")
    text = text.replace("compression_mode: ''", "compression_mode: file")
    assert "*a8\n" in text
    metadata.write_text(f"a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n{layers}{text}")
    return bag


def _altered(folder: Path, *words: str) -> Path:
    bag = _second(folder, StoragePlugin.SQLITE3, CompressionMode.NONE)
    (path,) = bag.glob("*.db3")
    with sqlite3.connect(path) as opened:
        for sentence in words:
            opened.execute(sentence)
    opened.close()
    return path


def endless_search(folder: Path) -> Path:
    """An SQLite view that looks for a row for ever and gives none."""
    view = f"CREATE VIEW schema AS {ENDLESS.format('x AS schema_version')} WHERE x < 0"
    return _altered(folder, "DROP TABLE schema", view)


def endless_rows(folder: Path) -> Path:
    """An SQLite view with rows for ever."""
    columns = "x AS id, 'a' AS topic_type, 'ros2msg' AS encoding, 'b' AS encoded_message_definition"
    view = f"CREATE VIEW message_definitions AS {ENDLESS.format(columns + ', 0 AS type_description_hash')}"
    return _altered(folder, "DROP TABLE message_definitions", view)


def pipe(folder: Path) -> Path:
    """A pipe that nobody writes into, in the place of a bag's file."""
    bag = _second(folder, StoragePlugin.SQLITE3, CompressionMode.NONE)
    (path,) = bag.glob("*.db3")
    path.unlink()
    os.mkfifo(path)
    return bag


HOSTILE: Mapping[str, Callable[[Path], Path]] = {
    made.__name__: made
    for made in (
        bzip2_bag,
        zstandard_mcap,
        zstandard_messages,
        zstandard_file,
        long_metadata,
        anchors,
        endless_search,
        endless_rows,
        pipe,
    )
}
