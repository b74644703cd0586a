"""Blackbox logs with known answers, written number by number from Betaflight's "Blackbox logging internals".

Nothing here comes from the reader: it writes bits into strings and keeps each field's history as the firmware does.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

MARK = "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\n"
END = b"E\xffEnd of log\0"
MINTHROTTLE, VBATREF, LOWEST = 1070, 420, 158


@dataclass(frozen=True)
class Field:
    name: str
    signed: int
    i: tuple[int, int]  # predictor, encoding in I frames
    p: tuple[int, int]


# --- numbers to bytes ------------------------------------------------------------------------------------------------
def vb(value: int) -> bytes:
    value &= 0xFFFFFFFF
    out = []
    while value > 127:
        out.append(value % 128 + 128)
        value //= 128
    return bytes([*out, value])


def zigzag(value: int) -> int:
    return 2 * value if value >= 0 else -2 * value - 1


def svb(value: int) -> bytes:
    return vb(zigzag(value))


def _twos(value: int, bits: int) -> str:
    return format(value % (1 << bits), f"0{bits}b")


def _packed(bits: str) -> bytes:
    bits += "0" * (-len(bits) % 8)
    return bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8))


def elias(value: int) -> str:
    """The bits of a number; 0xFFFFFFFE and 0xFFFFFFFF share an escape."""

    def plain(number: int) -> str:
        whole = format(number, "b")
        length = format(len(whole), "b")
        return "0" * (len(length) - 1) + length + whole[1:]

    return plain(0xFFFFFFFF) + str(value - 0xFFFFFFFE) if value >= 0xFFFFFFFE else plain(value + 1)


def _fits(value: int, bits: int) -> bool:
    return -(1 << (bits - 1)) <= value < 1 << (bits - 1)


def tag8_4s16(values: Sequence[int]) -> bytes:
    tag, bits = 0, ""
    for i, value in enumerate(values):
        size = 0 if value == 0 else next(k for k, n in ((1, 4), (2, 8), (3, 16)) if _fits(value, n))
        tag += size << (2 * i)
        bits += _twos(value, (0, 4, 8, 16)[size]) if size else ""
    return bytes([tag]) + _packed(bits)


def tag2(values: Sequence[int], *, variable: bool) -> bytes:
    a, b, c = values
    middle, large = ((5, 5, 4), (8, 7, 7)) if variable else ((4, 4, 4), (6, 6, 6))
    if all(_fits(v, 2) for v in values):
        return _packed("00" + "".join(_twos(v, 2) for v in values))
    if all(_fits(v, n) for v, n in zip(values, middle, strict=True)):
        filler = "" if variable else "00"
        return _packed("01" + filler + "".join(_twos(v, n) for v, n in zip(values, middle, strict=True)))
    if all(_fits(v, n) for v, n in zip(values, large, strict=True)):
        if variable:
            return _packed("10" + _twos(a, 8) + _twos(b, 7) + _twos(c, 7))
        return _packed("10" + _twos(a, 6) + "00" + _twos(b, 6) + "00" + _twos(c, 6))
    tag, body = 0xC0, b""
    for i, value in enumerate(values):
        size = next(n for n in (1, 2, 3, 4) if _fits(value, 8 * n))
        tag += (size - 1) << (2 * i)
        body += (value % (1 << (8 * size))).to_bytes(size, "little")
    return bytes([tag]) + body


def written(values: Sequence[int], encodings: Sequence[int]) -> bytes:
    """The bytes of a frame's numbers, in their encodings."""
    out, bits, at = b"", "", 0
    most = {6: 8, 7: 3, 8: 4, 10: 3}
    while at < len(values):
        encoding, end = encodings[at], at + 1
        if encoding in (4, 5):  # bits run on until a field of whole bytes
            bits += elias(values[at] % (1 << 32) if encoding == 4 else zigzag(values[at]))
        elif encoding != 9:
            out, bits = out + _packed(bits), ""
        while end < len(values) and encodings[end] == encoding and end - at < most.get(encoding, 1):
            end += 1
        row = list(values[at:end])
        if encoding == 0:
            out += svb(row[0])
        elif encoding == 1:
            out += vb(row[0])
        elif encoding == 3:
            out += vb(-row[0] % (1 << 14))
        elif encoding == 6:
            tag = sum(1 << i for i, v in enumerate(row) if v)
            out += svb(row[0]) if len(row) == 1 else bytes([tag]) + b"".join(svb(v) for v in row if v)
        elif encoding == 8:
            out += tag8_4s16(row + [0] * (4 - len(row)))
        elif encoding in (7, 10):
            out += tag2(row + [0] * (3 - len(row)), variable=encoding == 10)
        at = end
    return out + _packed(bits)


# --- logs ------------------------------------------------------------------------------------------------------------
def _wrapped(value: int) -> int:
    """What 32 bits keep of a difference."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


def _prediction(kind: int, field: int, row: Sequence[int], past: Sequence[Sequence[int]], names: Sequence[str]) -> int:
    one = past[0][field] if past else 0
    two = past[1][field] if len(past) > 1 else one
    if kind == 3:
        return int((one + two) / 2)  # C cuts towards zero
    return {
        0: 0, 1: one, 2: 2 * one - two, 4: MINTHROTTLE, 5: row[names.index("motor[0]")] if kind == 5 else 0,
        6: row[field], 7: 0, 8: 1500, 9: VBATREF, 10: 0, 11: LOWEST,
    }[kind]  # fmt: skip


def header(
    fields: Sequence[Field], *, interval: int, share: str, more: Mapping[str, object], extra: str = "", mark: str = MARK
) -> bytes:
    lists = {
        "I name": [f.name for f in fields], "I signed": [f.signed for f in fields],
        "I predictor": [f.i[0] for f in fields], "I encoding": [f.i[1] for f in fields],
        "P predictor": [f.p[0] for f in fields], "P encoding": [f.p[1] for f in fields],
    }  # fmt: skip
    text = mark + "".join(f"H Field {name}:{','.join(map(str, row))}\n" for name, row in lists.items())
    values = {"I interval": interval, "P interval": share, "minthrottle": MINTHROTTLE, "vbatref": VBATREF,
              "motorOutput": f"{LOWEST},2047", **more}  # fmt: skip
    return (text + extra + "".join(f"H {name}:{value}\n" for name, value in values.items())).encode()


def frames(
    fields: Sequence[Field],
    rows: np.ndarray,
    *,
    interval: int,
    between: Mapping[int, bytes] | None = None,
) -> list[bytes]:
    """One string of bytes a frame; `between` gives what stands before a frame. An I frame every `interval` frames."""
    names, out, past = [f.name for f in fields], list[bytes](), list[Sequence[int]]()
    for k, row in enumerate(rows.tolist()):
        intra = k % interval == 0
        predictors = [(f.i if intra else f.p)[0] for f in fields]
        rest = [
            _wrapped(row[i] - _prediction(p, i, row, [] if intra else past, names)) for i, p in enumerate(predictors)
        ]
        encodings = [(f.i if intra else f.p)[1] for f in fields]
        piece = (between or {}).get(k, b"") + (b"I" if intra else b"P") + written(rest, encodings)
        out.append(piece)
        past = [row] if intra else [row, *past[:1]]
    return out


ROTORFLIGHT = (
    Field("loopIteration", 0, (0, 1), (6, 9)),
    Field("time", 0, (0, 1), (2, 0)),
    *(Field(f"setpoint[{i}]", 1, (0, 0), (1, 8)) for i in range(4)),
    *(Field(f"mixer[{i}]", 1, (0, 0), (1, 8)) for i in range(4)),
    *(Field(f"axisP[{i}]", 1, (0, 0), (1, 7)) for i in range(3)),
    *(Field(f"gyroADC[{i}]", 1, (0, 0), (3, 0)) for i in range(3)),
    *(Field(f"accADC[{i}]", 1, (0, 0), (3, 0)) for i in range(3)),
    Field("vbatLatest", 0, (9, 3), (1, 6)),
    Field("amperageLatest", 0, (0, 1), (1, 6)),
    Field("headspeed", 0, (0, 1), (3, 0)),
    Field("motor[0]", 1, (0, 0), (3, 0)),
    *(Field(f"servo[{i}]", 0, (8, 0), (3, 0)) for i in range(4)),
)
"""Rotorflight's own fields, predictors and encodings, in its order."""

RF_HEADER: dict[str, object] = {
    "Firmware type": "Rotorflight", "Firmware revision": "Rotorflight 4.4.0 (abc1234) STM32F745", "Craft name": "Trex",
    "gyro_scale": "0x3f800000", "acc_1G": 2048, "rollPID": "50,100,20", "gyro_lpf1_static_hz": 100,
}  # fmt: skip


def rotorflight(
    columns: Mapping[str, np.ndarray],
    *,
    step_us: int = 2000,
    interval: int = 16,
    start_us: int = 5_000_000,
    between: Mapping[int, bytes] | None = None,
    end: bytes = END,
    more: Mapping[str, object] | None = None,
) -> bytes:
    """A Rotorflight log of every loop; fields that `columns` does not give are zero (servos 1500, battery 4.2 V)."""
    count = len(next(iter(columns.values())))
    rows = np.zeros((count, len(ROTORFLIGHT)), dtype=np.int64)
    plain = {
        "loopIteration": np.arange(count),
        "time": (start_us + step_us * np.arange(count)) % (1 << 32),
        "vbatLatest": np.full(count, VBATREF),
        **{f"servo[{i}]": np.full(count, 1500) for i in range(4)},
    }
    for i, field in enumerate(ROTORFLIGHT):
        rows[:, i] = {**plain, **columns}.get(field.name, 0)
    top = header(ROTORFLIGHT, interval=interval, share="1/1", more={**RF_HEADER, **(more or {})})
    return top + b"".join(frames(ROTORFLIGHT, rows, interval=interval, between=between)) + end


def event(kind: int, *numbers: int) -> bytes:
    return b"E" + bytes([kind]) + b"".join(vb(n) for n in numbers)


def adjustment(function: int, value: float) -> bytes:
    return b"E" + bytes([13, function | 128]) + struct.pack("<f", value)
