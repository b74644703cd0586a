"""What swashplate promises about speed, side by side with its peers, measured in one run.

python -m benchmarks.run [--short] [--out FILE.json]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks import (
    closed_loops,
    export,
    frequency,
    helicopter,
    identifying,
    link,
    live,
    many,
    peers,
    single,
    state_space,
)
from benchmarks.rotor_options import rotor_options
from benchmarks.timing import Result, Span

JSBSIM_RATIO = 2.0
"""How many times faster than JSBSim's helicopter one CoaX has to be."""


def measure(*, short: bool) -> list[Result]:
    """Every benchmark; the short form flies a few steps beyond compilation and shows that each can be run."""
    scale, repeats = (1, 1) if short else (25, 10)
    results = [
        peers.jsbsim_ah1s(steps=800 * scale, repeats=repeats),
        single.scan(steps=4_000 * scale, repeats=2 * repeats),
        single.numpy_loop(steps=20 * scale, repeats=repeats),
        single.c_loop(steps=20_000 * scale, repeats=repeats),
        export.step("coax", steps=20_000 * scale, repeats=repeats),
        *(
            []
            if short
            else [export.step("raptor50", steps=4_000 * scale, repeats=repeats, bar=True, inflow="pitt-peters")]
        ),
        *many.batches("coax", "float64", steps=10 * scale, repeats=repeats),
        *([] if short else many.batches("coax", "float32", steps=10 * scale, repeats=repeats)),
        *([] if short else many.batches("raptor50", "float64", steps=4 * scale, repeats=repeats, promised=False)),
        helicopter.scan(steps=4_000 * scale, repeats=2 * repeats),
        helicopter.speeds(count=2 * scale, repeats=repeats),
        *([] if short else [helicopter.lpv(steps=200 * scale, repeats=repeats)]),  # compiles for seconds
        *rotor_options(steps=4_000 * scale, repeats=repeats, short=short),
        *link.measure(short=short),
        *([] if short else [closed_loops.observers(count=128, repeats=2)]),
    ]
    jsbsim, scan = results[0], results[1]
    results[0] = replace(jsbsim, note=f"{jsbsim.note}; simulate is {scan.rate / jsbsim.rate:.1f} times faster")
    required = max(scan.target or 0.0, JSBSIM_RATIO * jsbsim.rate)
    results[1] = replace(scan, target=required)
    return results


def machine() -> dict[str, object]:
    """What the numbers were measured on."""
    packages = {name: metadata.version(name) for name in ("swashplate", "numpy", "casadi", "jsbsim")}
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load_before": os.getloadavg()[0],
        "python": platform.python_version(),
        "packages": packages,
    }


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def verdict(target: float | None, met: bool, *, short: bool) -> str:
    """Whether a promise was kept, where one was made; the short form runs beside the tests and judges nothing."""
    return "" if target is None or short else ("met" if met else "MISSED")


def show(title: str, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """One table on the screen, its numbers to the right."""
    table = Table(title=title)
    for place, heading in enumerate(headings):
        table.add_column(heading, justify="right" if place in (1, 2) else "left")
    for row in rows:
        table.add_row(*row)
    Console().print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--short", action="store_true", help="fewer steps and repeats, nothing judged: what else runs slows it"
    )
    parser.add_argument("--out", type=Path, help="also write the results as JSON")
    options = parser.parse_args()
    found: dict[str, object] = {"machine": machine()}

    def keep(part: str, measured: Sequence[Result | Span | live.Punctual]) -> None:
        """Write what there is so far: minutes of measuring outlive an error in a later part."""
        found[part] = [one.as_json() for one in measured]
        if options.out is not None:
            options.out.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")

    results = measure(short=options.short)
    keep("results", results)
    show(
        f"Steps per second, best of several ({_processor()}, {os.cpu_count()} cores)",
        ("what", "rate", "promised", "", "note"),
        [
            (
                r.name,
                f"{r.rate:,.0f}",
                "" if r.target is None else f"{r.target:,.0f}",
                verdict(r.target, r.met, short=options.short),
                r.note,
            )
            for r in results
        ],
    )
    repeats = 1 if options.short else 5
    spans = [
        *([] if options.short else [closed_loops.flights(count=1000, one_by_one=5)]),
        *identifying.measure(short=options.short),
        frequency.responses(repeats=repeats, length=100.0 if options.short else frequency.SECONDS),
        *frequency.reading(repeats=repeats),
        *frequency.x8(repeats=repeats),
        *([] if options.short else [frequency.fit(repeats=1)]),
        state_space.against_subspaces(seconds=20.0 if options.short else state_space.SECONDS),
    ]
    keep("spans", spans)
    show(
        "Seconds",
        ("what", "seconds", "promised", "", "note"),
        [
            (s.name, f"{s.seconds:.2f}", f"{s.target:.2f}", verdict(s.target, s.met, short=options.short), s.note)
            for s in spans
        ],
    )
    flown = live.measure(short=options.short)
    keep("live", flown)
    show(
        "Live: 500 Hz physics and 100 Hz controller in real time",
        ("page", "lost %", "promised", "", "note"),
        [
            (
                run.name,
                f"{run.late:.3f}",
                f"{run.target:g}",
                verdict(run.target, run.met, short=options.short),
                run.note,
            )
            for run in flown
        ],
    )


if __name__ == "__main__":
    main()
