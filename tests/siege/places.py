"""Paths that are no file: every command that reads or writes ends in words where one is given to it."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from .found import Found, progress
from .kills import QUICK, SLOW, Siege, _inputs, _made_inputs, _put

SLOWEST = 10.0
"""s of the processor that a command may take to say what is wrong; it may wait for a minute by the clock."""

READ: Mapping[str, str] = {
    "inspect": "inspect ODD",
    "inspect, mapped": "inspect INPUTS/log.csv --mapping ODD",
    "plot": "inspect ODD --channels p --out OUT/a.svg",
    "respond": "respond ODD --inputs servo_roll --outputs p --band 1-6Hz --out OUT/r",
    "fit-tf": "identify --responses ODD --input servo_roll --form 0/1 --out OUT/f",
    "fit-ss": "identify --structure ODD --responses INPUTS/responses.nc --out OUT/f",
    "fit-ss, responses": "identify --structure thirteen_state --responses ODD --out OUT/f",
    "fit-time": "identify --structure ODD --flight INPUTS/log.csv --out OUT/f",
    "compare": "compare INPUTS/responses.nc ODD --out OUT/a.html",
    "combine": "respond ODD --combine inverse --out OUT/c",
    "track": "track ODD --equation p_dot=Lp*p+bias --out OUT/t --settings rate=40",
    "identify": "identify --vehicle coax --flight ODD --free flight --method output-error --out OUT/f",
    "validate": "validate --vehicle ODD --flight INPUTS/flight.nc --out OUT/v",
    "simulate": "simulate --vehicle ODD --maneuver hover:1s --out OUT/a.nc",
    "simulate, controller": "simulate --vehicle coax --controller ODD --maneuver hover:1s --out OUT/a.nc",
    "linearize": "vehicle linearize ODD --out OUT/l",
    "stitch": "vehicle stitch INPUTS/at0.toml ODD --out OUT/m.toml --settings title=a",
    "derivatives": "vehicle derivatives raptor50 --published ODD",
    "reconstruct": "inspect ODD --reconstruct --out OUT/a.nc",
    "rotor-speed": "inspect ODD --rotor-speed",
    "control check": "control check coax --controller ODD",
    "export": "export ODD --format c --out OUT/e",
    "bench evaluate": "bench evaluate ODD --out OUT/c.toml",
    "campaign": "campaign run ODD -o OUT/c",
    "trim": "vehicle trim ODD",
}
"""Commands that read, with ODD for what they read."""
_WRITERS = {**QUICK, **{name: SLOW[name] for name in ("stitch", "linearize", "simulate")}}
WRITE: Mapping[str, str] = {
    name: " ".join(command.new).replace(command.new[command.new.index("--out") + 1], "ODD")
    for name, command in _WRITERS.items()
}
"""Commands that write, with ODD for where."""


def _fifo(path: Path) -> Path:
    os.mkfifo(path)
    return path


def _loop(path: Path) -> Path:
    path.symlink_to(path)
    return path


def _dangling(path: Path) -> Path:
    path.symlink_to(path.with_name("nowhere") / "at all")
    return path


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


def _closed(path: Path) -> Path:
    """Without permissions; the commands have none of the superuser's."""
    path.write_text("x")
    path.chmod(0)
    return path


def _in_closed(path: Path) -> Path:
    path.mkdir()
    path.chmod(0)
    return path / f"a{path.suffix}"


def _text(content: str) -> Callable[[Path], Path]:
    def make(path: Path) -> Path:
        path.write_text(content)
        return path

    return make


PLACES: Mapping[str, Callable[[Path], Path]] = {
    "nothing": lambda path: path,
    "empty": _text(""),
    "one blank": _text(" "),
    "zeros": _text("\0" * 4096),
    "folder": _folder,
    "pipe that nobody writes into": _fifo,
    "link to itself": _loop,
    "link to nothing": _dangling,
    "no permission": _closed,
    "in a folder without permission": _in_closed,
    "below a file": lambda path: _text("x")(path) / f"a{path.suffix}",
    "name of 300 letters": lambda path: path.with_name("a" * 300 + path.suffix),
    "name with a line break": lambda path: path.with_name(f"a\nb\udcff{path.suffix}"),
    "device without end": lambda path: Path("/dev/zero"),
    "device that is full": lambda path: Path("/dev/full"),
}


def besiege(
    *, commands: Sequence[str] = (*READ, *WRITE), places: Sequence[str] = tuple(PLACES), loaded: Sequence[str] = ()
) -> Found:
    """Every command with every place where it reads, or where it writes; those of `commands` and `places` only.

    `loaded` as in `kills.besiege`: without it all modules are, and what commands make for other commands is made.
    """
    bad: list[str] = []
    tried, ended = Counter[str](), {place: Counter[int]() for place in places}
    with tempfile.TemporaryDirectory(prefix="siege-") as name:
        folder = Path(name)
        inputs, out = folder / "inputs", folder / "cases" / "area" / "OUT"
        inputs.mkdir()
        _inputs(inputs)
        siege = Siege(folder, loaded=loaded)
        try:
            if not loaded:
                _made_inputs(siege, inputs)
            for command, words in {**READ, **{f"{n} (writes)": w for n, w in WRITE.items()}}.items():
                if command.removesuffix(" (writes)") not in commands:
                    continue
                for place in places:
                    _put({"mine.txt": b"mine"}, out)
                    suffix = ".nc" if "ODD" in words.split()[:2] else ".csv"
                    odd = PLACES[place](out / f"odd{suffix}")
                    given = words.replace("INPUTS", str(inputs)).replace("OUT", str(out))
                    arguments = [str(odd) if word == "ODD" else word for word in given.split()]
                    told, said = siege.run(arguments, unprivileged=True, seconds=60.0)
                    ended[place][told["code"]] += 1
                    tried[place] += 1
                    wrong = _wrong(told, said, place, out, reads="(writes)" not in command)
                    bad += [f"{command}, {place}: {problem}" for problem in wrong]
                    for path in out.iterdir():
                        if path.is_dir() and not path.is_symlink():
                            path.chmod(0o700)
                    progress(f"{command}: {sum(tried.values())} runs, {len(bad)} bad")
        finally:
            siege.close()
            shutil.rmtree(out, ignore_errors=True)
    rows = [[place, tried[place], ended[place][2], ended[place][0], _of(bad, place)] for place in places]
    rows.append(["all", *(sum(row[k] for row in rows) for k in range(1, 5))])
    text = (
        f"{sum(tried.values()):,} runs of {len(READ)} commands that read and {len(WRITE)} that write, with a path that "
        "is no file, as a user without the superuser's rights. Wanted are a message and exit code 2 (0 where the path "
        f"will do after all) within {SLOWEST:g} s, the user's own file untouched and no temporary file."
    )
    return Found("Siege: odd paths", text, ["path", "runs", "refused in words", "worked", "wrong"], rows, bad)


def _of(bad: Sequence[str], place: str) -> int:
    return sum(f", {place}: " in words for words in bad)


def _wrong(told: Mapping[str, object], said: str, place: str, out: Path, *, reads: bool) -> list[str]:
    wrong = []
    if told["hang"] or float(str(told["seconds"])) > SLOWEST:
        wrong.append(
            f"takes {told['seconds']:.1f} s of the processor, and hangs"
            if told["hang"]
            else f"takes {told['seconds']:.1f} s"
        )
    elif told["code"] not in ((2,) if reads else (0, 2)):
        wrong.append(f"ends with {told['code']}: {said.strip()[-300:]!r}")
    elif told["code"] == 2 and ("Traceback" in said or "bug" in said or len(said) > 2_100):
        wrong.append(f"says {said.strip()[-300:]!r}")
    if (out / "mine.txt").read_bytes() != b"mine":
        wrong.append("the user's own file is gone")
    return wrong + [f"leaves {path.name}" for path in out.rglob(".swash-*")]
