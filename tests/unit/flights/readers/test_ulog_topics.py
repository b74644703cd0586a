"""The topics of a ULog file are pyulog's to the bit, though pyulog gets a small part of the file."""

from __future__ import annotations

import io
import itertools
import os
import struct
from pathlib import Path

import numpy as np
import pytest

import made_autopilot_logs as made
from swashplate.errors import FlightError
from swashplate.flights.readers import dataflash, source, ulog_topics
from swashplate.flights.readers.log_fields import log_fields
from swashplate.flights.readers.source import open_source
from swashplate.flights.readers.ulog_messages import WholeMessages
from swashplate.flights.readers.ulog_topics import Topics

pytest.importorskip("pyulog")


def message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def subscribed(content: bytes, name: str, instance: int, number: int, *times: int) -> bytes:
    """A log with one more instance of a topic of a stamp and a float."""
    data = (message("D", struct.pack("<HQf", number, time, time / 7)) for time in times)
    return b"".join([content, message("A", struct.pack("<BH", instance, number) + name.encode()), *data])


def appended(content: bytes) -> bytes:
    """A log whose flags say that data were appended at its end."""
    flags = bytearray(content[19:59])
    flags[8] = 1
    flags[16:24] = struct.pack("<Q", len(content))
    return content[:19] + bytes(flags) + content[59:] + message("I", b"\x0achar[3] endend")


def longer(content: bytes) -> bytes:
    """A log in which some messages have bytes behind their fields, and one is too short."""
    number = list(made.ULOG_TOPICS).index("strange_topic")
    bodies = (struct.pack("<HQf", number, 9_000_000 + size, 1.0)[: 14 - size % 2] + bytes(size) for size in (0, 3, 8))
    return content + b"".join(message("D", body) for body in bodies) + message("O", b"\x05\0")


WHOLE = made.ulog(600, dropout=True)
LOGS = {
    "whole": WHOLE,
    "two instances": subscribed(WHOLE, "strange_topic", 1, 900, 5_000_000, 5_100_000, 5_050_000),
    "a number given twice": subscribed(WHOLE, "strange_topic", 2, 3, 5_000_000, 5_100_000),
    "a topic that nothing describes": subscribed(WHOLE, "nobody_knows_it", 0, 901, 5_000_000),
    "data before their number is given": subscribed(
        WHOLE + message("D", struct.pack("<HQf", 902, 1, 1.0)), "strange_topic", 1, 902, 5_000_000
    ),
    "data appended": appended(WHOLE),
    "other sizes": longer(WHOLE),
    "a clock that jumps, then a dropout": WHOLE.replace(message("O", struct.pack("<H", 120)), b"")
    + message("D", struct.pack("<HQf", list(made.ULOG_TOPICS).index("strange_topic"), 77_000_000, 1.0))
    + message("O", b"\x07\0")
    + message("P", b"\x07float Px"[:8] + struct.pack("<f", 2.0)),
}


@pytest.mark.parametrize("name", LOGS)
def test_topics_are_those_of_pyulog(name: str) -> None:
    from pyulog.core import ULog

    expected, got = ULog(io.BytesIO(LOGS[name])), Topics(LOGS[name], name)
    assert [(one.name, one.instance) for one in got.topics] == [(d.name, d.multi_id) for d in expected.data_list]
    for topic, data in zip(got.topics, expected.data_list, strict=True):
        assert list(topic.kind.factors) == [field.field_name for field in data.field_data]
        table = dataflash.gathered(topic.content, topic.kind)
        for field, values in data.data.items():
            assert table.columns[field].tobytes() == values.tobytes(), (topic.name, field)
    log = got.log
    assert log.file_corruption == expected.file_corruption
    assert [(d.timestamp, d.duration) for d in log.dropouts] == [(d.timestamp, d.duration) for d in expected.dropouts]
    assert log.changed_parameters == expected.changed_parameters
    assert log.logged_messages == expected.logged_messages
    assert log.initial_parameters == expected.initial_parameters
    assert log.msg_info_dict == expected.msg_info_dict


def test_pyulog_gets_a_small_part_of_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes, parsed = [], ulog_topics._parsed
    monkeypatch.setattr(
        ulog_topics, "_parsed", lambda content, where: (sizes.append(len(content)), parsed(content, where))[1]
    )
    Topics(WHOLE, "whole")
    assert sum(sizes) < len(WHOLE) / 20
    Topics(appended(WHOLE), "appended")
    assert sizes[-1] > len(WHOLE), "what pyulog might read otherwise it gets as a whole"


def test_every_message_is_followed_and_what_is_damaged_is_not() -> None:
    whole = WholeMessages(WHOLE)
    ends = sorted([(at, at + size) for (_, size), places in whole.data.items() for at in places.tolist()])
    ends = sorted([*ends, *((at, end) for _, at, end in whole.others)])
    assert ends[0][0] == 16
    assert all(one[1] == following[0] for one, following in itertools.pairwise(ends))
    assert ends[-1][1] == len(WHOLE)
    at = ends[len(ends) // 2][0]
    torn = WholeMessages(WHOLE[:at] + b"\xee" * 40 + WHOLE[at:-3])
    assert (torn.lost, torn.unfinished > 0) == (40, True)


def test_a_log_on_disk_that_is_cut_off_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "_LEFT_ON_DISK", 0)
    path = tmp_path / "a.ulg"
    path.write_bytes(WHOLE)
    opened, fields = open_source(path), log_fields(path)
    assert fields is not None
    (topic,) = (one for one in Topics(opened.stored, "a").topics if one.name == "vehicle_attitude")
    _, values = fields.read("vehicle_attitude.q[1]")
    assert np.array_equal(dataflash.gathered(topic.content, topic.kind).number("q[1]"), values)
    os.truncate(path, len(WHOLE) // 2)
    with pytest.raises(FlightError, match="cut off while it was read"):
        dataflash.gathered(topic.content, topic.kind).number("q[1]")
    with pytest.raises(FlightError, match="has changed"):
        fields.read("vehicle_attitude.q[1]")
