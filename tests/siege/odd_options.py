"""Odd values of every option and setting: a command refuses one in words, or does what it says."""

from __future__ import annotations

import random
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import typer

from swashplate.api.question import entries
from swashplate.cli.app import app

from .found import Found, progress
from .kills import Siege

SLOWEST = 60.0
"""s of the processor that a command with an odd value may take: it may be one that is computed with."""

_NUMBERS = ("", "nan", "inf", "-1", "0", "-0.0", "1e-320", "1e308", "99999999999999999999")
VALUES = (*_NUMBERS, "abc", "1,2", "1:0", "p=q", "0-12/0", "[1", "../..", ".", "\u202e")

LINES: Mapping[str, str] = {
    "inspect": "examples/coax_flight",
    "respond": "examples/helicopter_sweeps",
    "identify": "--responses none.nc --input lateral",
    "track": "examples/coax_flight --equation p_dot=Lp*p+bias",
    "validate": "--vehicle coax --flight none.nc",
    "compare": "coax raptor50",
    "maneuver check": "doublet:pitch,1s,0.1",
    "maneuver design": "crazyflie --unknown Ixx",
    "maneuver need": "none.json",
    "vehicle trim": "raptor50",
    "vehicle linearize": "raptor50",
    "vehicle derivatives": "raptor50",
    "vehicle show": "coax",
    "vehicle new": "raptor50",
    "vehicle stitch": "none.toml",
    "simulate": "--vehicle coax --maneuver hover:1s",
    "control gains": "raptor50",
    "control design": "coax",
    "control check": "coax",
    "control decouple": "coax",
    "control monte-carlo": "--vehicle coax --controller none.toml",
    "export": "coax",
    "bench evaluate": "none",
    "campaign run": "none.toml",
}
"""Verbs that end by themselves, with what they need besides."""


def commands(group: Any = None, before: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Every verb of `LINES` with its command."""
    group = typer.main.get_command(app) if group is None else group
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        if hasattr(command, "list_commands"):
            yield from commands(command, (*before, name))
        elif " ".join((*before, name)) in LINES:
            yield " ".join((*before, name)), command


def cases() -> list[tuple[str, list[str]]]:
    """Every verb, option or setting, and value: the verb, and the line."""
    made = []
    for verb, command in commands():
        line = [*verb.split(), *LINES[verb].split()]
        options = [p.opts[0] for p in command.params if p.param_type_name == "option" and not p.is_flag]
        settings = [name for name, (_, entry) in entries(command.question).items() if entry.place == "setting"]
        for value in VALUES:
            made += [(verb, [*line, option, value]) for option in options]
            made += [(verb, [*line, "--settings", f"{name}={value}"]) for name in settings]
    return made


def wrong(told: Mapping[str, Any], said: str) -> str:
    """What should not have been; "" where a command refused in words, or worked."""
    if told["hang"] or told["seconds"] > SLOWEST:
        return f"takes {told['seconds']:.0f} s"
    if told["code"] not in (0, 2) or "Traceback" in said or "bug in swashplate" in said:
        return f"ends with {told['code']}: {said.strip()[-200:]!r}"
    return ""


def besiege(
    *, count: int, seconds: float, seed: int, verbs: Sequence[str] = tuple(LINES), loaded: Sequence[str] = ()
) -> Found:
    """So many of all cases at random, as long as there is time."""
    chosen, ends = [case for case in cases() if case[0] in verbs], time.monotonic() + seconds
    random.Random(seed).shuffle(chosen)
    bad: list[str] = []
    ended = {verb: Counter[Any]() for verb in verbs}
    with tempfile.TemporaryDirectory(prefix="siege-") as name:
        (folder := Path(name) / "a" / "b" / "c").mkdir(parents=True)  # "../.." is a folder of ours, too
        siege = Siege(folder, loaded=loaded)
        try:
            for verb, line in chosen[:count]:
                if time.monotonic() > ends:
                    break
                told, said = siege.run(line, seconds=SLOWEST)
                problem = wrong(told, said)
                bad += [f"{line}: {problem}"] if problem else []
                ended[verb]["wrong" if problem else told["code"]] += 1
                progress(f"{sum(map(Counter.total, ended.values()))} odd options, {len(bad)} bad")
        finally:
            siege.close()
    rows = [[verb, each.total(), each[2], each[0], each["wrong"]] for verb, each in ended.items()]
    rows.append(["all", *(sum(row[k] for row in rows) for k in range(1, 5))])
    text = (
        f"{rows[-1][1]:,} of {len(chosen):,} pairs of an option or a setting and one of {len(VALUES)} odd values "
        "(nothing, no number, infinity, far too large, of another kind). Wanted are a message and exit code 2, or a "
        f"result, within {SLOWEST:g} s of the processor."
    )
    return Found("Siege: odd options", text, ["verb", "runs", "refused in words", "worked", "wrong"], rows, bad)
