"""Commands as a user starts them, each a process of its own, for campaigns that change what is around them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import swashplate as sp
from hostile_bags import packed_bag
from swashplate.control.kinds import save_controller
from swashplate.control.lqg.design import design
from swashplate.filtering.sensor_suite import suite

from .kills import _inputs

SLOWEST = 120.0
"""s after which a command hangs, on a machine that others use, too."""
QUICK: Mapping[str, str] = {
    "help": "--help",
    "inspect a table": "inspect INPUTS/log.csv",
    "inspect a bag": "inspect INPUTS/packed",
    "maneuver": "maneuver sweep:pitch,0.5-4Hz,30s --out OUT/series.csv",
    "simulate": "simulate --vehicle coax --maneuver doublet:roll,0.5s,0.1 --out OUT/flight.nc",
}
"""What the short form runs."""
COMMANDS: Mapping[str, str] = {
    **QUICK,
    "inspect a flight": "inspect INPUTS/flight.nc",
    "plot": "inspect INPUTS/log.csv --channels p --out OUT/plot.html",
    "respond": "respond INPUTS/log.csv --inputs servo_roll --outputs p --band 1-6Hz --out OUT/found",
    "identify": "identify --vehicle coax --flight INPUTS/flight.nc --free flight --rate 20 --out OUT/fit --method "
    "output-error --settings iterations=1",
    "trim": "vehicle trim raptor50",
    "linearize": "vehicle linearize raptor50 --speed 0-5/5 --out OUT/models",
    "control": "control check coax --controller INPUTS/hold.toml",
    "export, C": "export coax --format c --out OUT/code",
    "export, FMU": "export coax --format fmu --out OUT/made",
    "campaign": "campaign run INPUTS/campaign.toml -o OUT/campaign --workers 1",
}
CAMPAIGN = """
kind = "campaign"
of = "monte-carlo"
count = 2
batch = 1
vehicle = "coax"
maneuver = "hover:0.2s"
controller = "hold.toml"
vary = {mass = "5%"}
"""


@dataclass(frozen=True)
class Ended:
    """How a command ended: its code, negative for a signal, None where it hung; and what it said."""

    code: int | None
    said: str

    def wrong(self) -> str:
        """What is wrong with it, "" where it is done or refused in words."""
        if self.code is None:
            return "hangs"
        if self.code not in (0, 2) or "Traceback" in self.said or "a bug" in self.said:
            return f"ends with {self.code}: {self.said.strip()[-300:]!r}"
        if self.code == 2 and (not self.said or len(self.said) > 2_100):
            return f"says {self.said.strip()[:300]!r}"
        return ""


class Machine:
    """Folders in which commands run: `here` (where they work), `out`, `home` and `temporary`."""

    def __init__(self, folder: Path) -> None:
        self.inputs, self.here = folder / "inputs", folder / "here"
        self.home, self.temporary = folder / "home", folder / "temporary"
        for place in (self.inputs, self.here, self.home, self.temporary):
            place.mkdir(mode=0o700)
        self.out = self.here / "OUT"
        self.out.mkdir()
        _inputs(self.inputs)
        packed_bag(self.inputs)

    def make_controller(self) -> None:
        """The controller that some commands read, and the campaign that flies it."""
        made = design(sp.vehicle("coax"), sensors=suite("gyro@50,mocap@50"), rate=50.0)
        save_controller(made, self.inputs / "hold.toml")
        (self.inputs / "campaign.toml").write_text(CAMPAIGN)

    def make_flight(self) -> None:
        """The flight that one of the commands reads; it takes seconds."""
        made = self.run("simulate --vehicle coax --maneuver multisine:roll+pitch,0.4-4Hz,8s,0.1 --out INPUTS/flight.nc")
        assert made.code == 0, made.said
        self.clear()

    def run(
        self, words: str, *, environment: Mapping[str, str | None] | None = None, before: str = "", after: str = ""
    ) -> Ended:
        """A command.

        Args:
            words: of it, with INPUTS and OUT.
            environment: what is other than usual; None is not there at all.
            before: words of the shell, such as "ulimit -n 64;".
            after: redirections.
        """
        around = {**os.environ, "HOME": str(self.home), "TMPDIR": str(self.temporary), "NO_COLOR": "1"}
        around |= {"PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"}
        for name in ("XDG_CACHE_HOME", "PYTHONPATH"):
            around.pop(name, None)
        for name, value in (environment or {}).items():
            around.pop(name, None)
            if value is not None:
                around[name] = value
        given = words.replace("INPUTS", str(self.inputs)).replace("OUT", str(self.out)).split()
        asked: Sequence[str] = [sys.executable, "-P", "-m", "swashplate", *given]
        shell = ["/bin/sh", "-c", f'{before} exec "$@" {after}', "sh", *asked]
        try:
            done = subprocess.run(
                shell, cwd=self.here, env=around, stdin=subprocess.DEVNULL, capture_output=True, timeout=SLOWEST,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return Ended(None, "")
        return Ended(done.returncode, (done.stderr or done.stdout).decode("utf-8", "replace"))

    def clear(self) -> list[str]:
        """Empty what commands write to; what they left that nobody asked for."""
        left = [path.name for path in (*self.here.rglob(".swash-*"), *self.temporary.iterdir())]
        left += [path.name for path in self.here.iterdir() if path != self.out]
        for place in (self.temporary, self.out):
            for path in place.iterdir():
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        return left


@contextmanager
def machine(commands: Sequence[str]) -> Iterator[Machine]:
    """A machine with what these commands read."""
    with tempfile.TemporaryDirectory(prefix="siege-") as name:
        made = Machine(Path(name))
        if any("INPUTS/flight.nc" in COMMANDS[command] for command in commands):
            made.make_flight()
        if {"campaign", "control"}.intersection(commands):
            made.make_controller()
        yield made
