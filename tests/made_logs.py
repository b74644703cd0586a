"""Small logs in the formats that are read, made by the tests themselves."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

N = 12


def coax_record(n: int = N, **changes: Any) -> dict[str, Any]:
    """The fields of a CoaX-56 record in which everything moves; `changes` replace fields (None removes one)."""
    t = np.arange(n) / 150.0
    half = 0.05 * np.sin(t)
    fields: dict[str, Any] = {
        "time": t,
        "position": np.stack([np.sin(t), np.cos(t), 1.0 + t]),
        "orientation": np.stack([np.sin(half), 0.3 * np.sin(half), 0 * t, np.sqrt(1 - 1.09 * np.sin(half) ** 2)]),
        "lintwist": np.stack([np.cos(t), -np.sin(t), np.ones(n)]),
        "angtwist": np.stack([t, 2 * t, 3 * t]),
        "inputs": np.stack([0.5 + t, 0.55 + t, 0.1 * t, -0.2 * t]),
    }
    return {name: value for name, value in (fields | changes).items() if value is not None}


def write_coax(path: Path, *, compressed: bool = True, **changes: Any) -> Path:
    savemat(path, {"Data": coax_record(**changes)}, do_compression=compressed)
    return path


def dimensions(*lengths: int) -> bytes:
    """The dimensions element of a MATLAB level 5 matrix."""
    return struct.pack("<II", 5, 4 * len(lengths)) + struct.pack(f"<{len(lengths)}i", *lengths)


def vicon(
    rows: list[str],
    *,
    title: str = "Objects",
    names: str = ",,Global Angle (Helical) coax:coax,,,,,",
    columns: str = "Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ",
    units: str = ",,rad,rad,rad,mm,mm,mm",
) -> str:
    return "\n".join([title, "100", names, columns, units, *rows, ""])


def motive(rows: list[str], *, first: str = "Rotation Type,Quaternion,Length Units,Meters", body: str = "coax") -> str:
    kinds = ["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"]
    return "\n".join(
        [
            f"Format Version,1.23,Take Name,test,Capture Frame Rate,120.000000,{first},Coordinate Space,Global",
            "",
            ",," + ",".join(["Rigid Body"] * 8 + ["Rigid Body Marker"] * 3),
            ",," + ",".join([body] * 8 + [f"{body}:Marker1"] * 3),
            ",," + ",".join(['"AB12"'] * 11),
            ",," + ",".join(kinds + ["Position"] * 3),
            "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z",
            *rows,
            "",
        ]
    )
