"""A SITL binary of ArduPilot as a process of ours: its command line, its ports, how it ended, and its end.

Command line and ports: ArduPilot, libraries/AP_HAL_SITL/SITL_cmdline.cpp (`--model`, `--defaults` with files separated
by commas, `-I` which adds 10 to every port, `--home`, `--speedup`). SERIAL0 is a TCP server on 5760 that waits for
its client; RC comes by UDP on 5501; servo packets go to UDP 9002. Logs and parameters lie in the folder where it runs.
"""

from __future__ import annotations

import socket
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from swashplate.errors import LinkError
from swashplate.links.sitl_binary import SitlBinary

MAVLINK_PORT, RC_PORT, PHYSICS_PORT = 5760, 5501, 9002
"""Of instance 0."""
_PER_INSTANCE = 10
_OTHERS = (2, 3)
"""SERIAL1 and SERIAL2, from SERIAL0's port."""
_HOME = "-35.363261,149.165230"
"""Where ArduPilot's own tests fly; the altitude is the vehicle's, because multicopters divide commands by the air's
density there (Thrust_Linearization::get_compensation_gain): 0.5 dB at the 584 m of that place."""


class Sitl(SitlBinary):
    """A binary in a folder of its own; used as a context, it is ended whatever happens.

    Args:
        binary: of ArduCopter for SITL.
        folder: where it runs: its output, parameters and logs; made where it is missing.
        defaults: parameter files in that folder, the last one counts; none are a firmware's own.
        instance: which of several on this machine.
        speedup: most simulated seconds a second.
        altitude: of the ground above the sea [m].

    Raises:
        LinkError: where the binary is missing or cannot be run, or one of its ports is taken.
    """

    taken = ("--instance", "Another SITL runs? Stop it, or give another --instance: it moves all ports by 10.")

    def __init__(
        self,
        binary: str | Path,
        folder: Path,
        defaults: Sequence[str],
        *,
        instance: int = 0,
        speedup: float = 10.0,
        altitude: float = 0.0,
    ) -> None:
        super().__init__(binary, folder, of="ArduCopter's")
        shift = _PER_INSTANCE * instance
        self.mavlink_port, self.rc_port = MAVLINK_PORT + shift, RC_PORT + shift
        self.physics_port = PHYSICS_PORT + shift
        self.command = [
            str(self.binary), "--model", "JSON:127.0.0.1", *(("--defaults", ",".join(defaults)) if defaults else ()),
            "-I", str(instance), "--home", f"{_HOME},{altitude:.0f},0", "--speedup", f"{speedup:g}",
        ]  # fmt: skip
        for port in (self.mavlink_port, *(self.mavlink_port + k for k in _OTHERS)):
            self.check_free(socket.SOCK_STREAM, port)
        self.check_free(socket.SOCK_DGRAM, self.rc_port)

    @property
    def output(self) -> Path:
        """What it prints."""
        return self.folder / "sitl.txt"

    def __enter__(self) -> Sitl:
        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            with self.output.open("wb") as log:
                self._process = subprocess.Popen(
                    self.command,
                    cwd=self.folder,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,  # whatever it starts itself is ended with it
                )
        except OSError as error:
            raise LinkError(
                f"cannot be run: {error.strerror or error}.",
                where=self.binary,
                hint="Is it a SITL build for this machine (./waf configure --board sitl)?",
            ) from None
        return self

    def text(self) -> str:
        try:
            return self.output.read_bytes()[-4000:].decode("utf-8", "replace")
        except OSError:
            return ""

    def wait_for_port(self, timeout: float) -> None:
        """Until SERIAL0 is opened.

        Raises:
            LinkError: where it ends before, or does not open it in time.
        """
        until = time.monotonic() + timeout
        while time.monotonic() < until:
            if ending := self.ended():
                raise LinkError(ending, where=self.binary, hint=f"All it printed is in {self.output}.")
            if _listens(self.mavlink_port):
                return
            time.sleep(0.05)
        raise LinkError(
            f"opened no MAVLink port (TCP {self.mavlink_port}) within {timeout:g} s.",
            where=self.binary,
            hint=f"Is it ArduCopter's SITL binary? What it printed: {self.last_words() or 'nothing'}",
        )

    def logs(self) -> list[Path]:
        """DataFlash logs that it wrote, in order."""
        return sorted((self.folder / "logs").glob("*.BIN"))


def _listens(port: int) -> bool:
    """Whether somebody listens on a TCP port, seen without connecting: SITL serves its first client only."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return True
    return False
