"""A ground station's telemetry log, written by pymavlink's own packers: what flew, frames of both versions, damage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as v2

START = 1_760_000_000_000_000
"""us since 1970 at which the autopilot started."""
BOOT = 30.0
"""s on its clock at which the log begins."""


@dataclass
class _Out:
    rows: list[bytes]
    writer: Any

    def send(self, name: str, time: float, *values: Any, late: float = 0.02) -> None:
        frame = getattr(self.writer, f"{name}_encode")(*values).pack(self.writer)
        self.rows.append((START + round(1e6 * (time + late))).to_bytes(8, "big") + bytes(frame))


def telemetry(
    path: Path,
    *,
    kind: int = 4,
    autopilot: int = 3,
    modes: Mapping[float, int] | None = None,
    said: str = "",
    seconds: float = 20.0,
    version: int = 2,
) -> Path:
    """Roll 0.2 sin(t), p its slope, at 10 Hz; a ground station speaks too.

    Args:
        kind, autopilot: of the heartbeat. modes: numbers by the time from which on they are flown [s].
        said: the firmware's own message. version: of MAVLink.
    """
    if version == 1:
        from pymavlink.dialects.v10 import ardupilotmega as v1

        writer: Any = v1.MAVLink(None, srcSystem=1, srcComponent=1)
        station: Any = v1.MAVLink(None, srcSystem=255, srcComponent=190)
    else:
        writer = v2.MAVLink(None, srcSystem=1, srcComponent=1)
        station = v2.MAVLink(None, srcSystem=255, srcComponent=190)
    out, theirs = _Out([], writer), _Out([], station)
    theirs.rows = out.rows
    out.send("statustext", BOOT, 6, (said or "hello").encode())
    for name, value in (("ATC_RAT_RLL_P", 0.11), ("H_RSC_MODE", 1.0)):
        out.send("param_value", BOOT, name.encode(), value, 9, 2, 0)
    now = 0
    for k, t in enumerate(np.arange(0.0, seconds, 0.1).tolist()):
        time, ms = BOOT + t, round(1e3 * (BOOT + t))
        if k % 10 == 0:
            now = next((mode for since, mode in sorted((modes or {}).items(), reverse=True) if t >= since), now)
            out.send("heartbeat", time, kind, autopilot, 128 if t > 2.0 else 0, now, 4)
            theirs.send("heartbeat", time, 6, 8, 0, 0, 4)
            out.send("sys_status", time, 0, 0, 0, 500, 12_600, 1500, 80, 0, 0, 0, 0, 0, 0)
        phi, p = 0.2 * np.sin(t), 0.2 * np.cos(t)
        out.send("attitude", time, ms, phi, 0.1, 1.0, p, 0.0, 0.0)
        out.send("gps_raw_int", time, round(1e6 * time), 3, 473_000_000 + k, 85_000_000, 500_000, 90, 150, 250, 0, 11)
        out.send("raw_imu", time, round(1e6 * time), 0, 0, -1000, round(1e3 * p), 0, 0, 0, 0, 0)
        out.send("servo_output_raw", time, round(1e6 * time), 0, 1500 + k % 100, *[0] * 7)
    path.write_bytes(b"".join(out.rows))
    return path
