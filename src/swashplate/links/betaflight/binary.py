"""A SITL binary of Betaflight as a process of ours: configured once, then run in a folder of its own.

It is run on a terminal of its own, because what it prints into a file comes out only when it ends. Its ports are fixed
(`packets`), so one runs on a machine at a time. `--config FILE` loads lines of the command line, writes `eeprom.bin`
and ends; logs are LOGnnnnn.BFL in the folder.
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
import subprocess
import threading
import time
from pathlib import Path

from swashplate.errors import LinkError
from swashplate.links.betaflight.packets import MSP_PORT, STATE_PORT, STICKS_PORT
from swashplate.links.sitl_binary import PATIENCE, SitlBinary

_CONFIGURED = "EEPROM saved"
_UP, _SETTLING = f"bind port {MSP_PORT}", 0.5
"""What it prints once its ports are open, and how long its sensors take from there [s]."""
_CLOCK = re.compile(rb"\[SITL\] t=(\d+)ms  spd")


class BetaflightBinary(SitlBinary):
    """A binary in a folder; used as a context, it is ended whatever happens.

    Args:
        binary: Betaflight's SITL. folder: where it runs; made where it is missing.

    Attributes:
        before: a library that is loaded before its own; None for none.
        clock: the time that its clock told last [s].

    Raises:
        LinkError: where the binary is missing or is no program, or one of its ports is taken.
    """

    taken = ("BINARY", "Another SITL runs? Stop it: Betaflight's ports cannot be moved.")
    repeats = "[FLASH_Program"

    def __init__(self, binary: str | Path, folder: Path) -> None:
        super().__init__(binary, folder, of="Betaflight's")
        self.before: Path | None = None
        for kind, port in (
            (socket.SOCK_DGRAM, STATE_PORT),
            (socket.SOCK_DGRAM, STICKS_PORT),
            (socket.SOCK_STREAM, MSP_PORT),
        ):
            self.check_free(kind, port)
        self._told = bytearray()
        self.clock = 0.0

    def configure(self, text: str, *, timeout: float) -> None:
        """Let it load lines of its command line.

        Raises:
            LinkError: where it does not, with what it said.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "configuration.txt").write_text(text, encoding="utf-8")
        self._start("--config", "configuration.txt")
        until = time.monotonic() + timeout
        while time.monotonic() < until and not self.ended():
            time.sleep(0.05)
        over = bool(self.ended(patience=0.2))
        self.stop()
        self._heard.join(PATIENCE)
        said = self.text()
        if not over or _CONFIGURED not in said:
            why = f"within {timeout:g} s" if not over else "and ended"
            raise LinkError(
                f"did not load a configuration {why}; its last words: {self.last_words() or 'none'}.",
                where=self.binary,
                hint="Is it Betaflight's SITL of 2025.12 or later (--config)?",
            )
        if "###ERROR" in said or "INVALID" in said.upper():
            wrong = next(line for line in said.splitlines() if "ERROR" in line.upper() or "INVALID" in line.upper())
            raise LinkError(f"refuses a line of its configuration: {wrong.strip()}.", where=self.binary)

    def __enter__(self) -> BetaflightBinary:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        (self.folder / "sitl.txt").write_bytes(bytes(self._told))

    def _start(self, *arguments: str) -> None:
        self._told.clear()
        environment = {**os.environ, **({"LD_PRELOAD": str(self.before)} if self.before else {})}
        mine, its = os.openpty()
        try:
            self._process = subprocess.Popen(
                [str(self.binary), *arguments], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=its, stderr=its,
                start_new_session=True, env=environment,
            )  # fmt: skip
        except OSError as error:
            os.close(mine)
            raise LinkError(
                f"cannot be run: {error.strerror or error}.", where=self.binary, hint="Is it a build for this machine?"
            ) from None
        finally:
            os.close(its)
        self._heard = threading.Thread(target=self._listen, args=(mine,), daemon=True)
        self._heard.start()

    def _listen(self, terminal: int) -> None:
        with contextlib.suppress(OSError):  # the other end is closed when it ends
            while piece := os.read(terminal, 4096):
                self._told += piece
                if times := _CLOCK.findall(piece):
                    self.clock = 1e-3 * float(times[-1])
        os.close(terminal)

    def text(self) -> str:
        return bytes(self._told).decode("utf-8", "replace")

    def wait_until_up(self, timeout: float) -> None:
        """Until it has opened its ports: a state that comes before ends it.

        Raises:
            LinkError: where it ends before, or does not get so far in time.
        """
        until = time.monotonic() + timeout
        while time.monotonic() < until:
            if ending := self.ended():
                raise LinkError(ending, where=self.binary)
            if _UP in self.text():
                time.sleep(_SETTLING)
                return
            time.sleep(0.05)
        raise LinkError(
            f"opened no MSP port (TCP {MSP_PORT}) within {timeout:g} s; its last words: {self.last_words() or 'none'}.",
            where=self.binary,
            hint="Is it Betaflight's SITL?",
        )

    def refusals(self) -> str:
        """Why it refuses to be armed, in its own words, as it said last; empty for nothing."""
        lines = [line for line in self.text().splitlines() if "Arming disabled:" in line]
        return lines[-1].partition("Arming disabled:")[2].strip() if lines else ""

    def logs(self) -> list[Path]:
        """Blackbox logs that it wrote, in order."""
        return sorted(self.folder.glob("LOG*.BFL"))


def wait_for_sitl(seconds: float) -> None:
    """Until somebody on this machine listens on the MSP port, and has had the time to find its sensors.

    Raises:
        LinkError: where nobody does.
    """
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("0.0.0.0", MSP_PORT))
            except OSError:
                time.sleep(_SETTLING)
                return
        time.sleep(0.2)
    raise LinkError(
        f"nobody listens on TCP {MSP_PORT} after {seconds:g} s: no SITL of Betaflight runs here.",
        channel="wait",
        hint="Start it in another terminal; its MSP port says that it is up.",
    )
