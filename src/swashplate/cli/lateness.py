"""Delays on the command line: `--delay`."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

Delay = Annotated[
    list[str] | None,
    typer.Option(
        "--delay",
        metavar="MS",
        help="From command to action [ms]: one number, or NAME=MS by input; the model's identified ones if not given.",
    ),
]


def delays_from(texts: list[str] | None) -> dict[str, float] | float | None:
    """`--delay 20` for all inputs, or `--delay NAME=20` each; milliseconds to seconds. None where nothing is said."""
    if not texts:
        return None
    plain = len(texts) == 1 and "=" not in texts[0]
    if plain:
        milliseconds = {"": options.numbers(texts[0], option="--delay", count=1)[0]}
    else:
        given = options.assignments(texts, option="--delay")
        milliseconds = {name: options.numbers(value, option="--delay", count=1)[0] for name, value in given.items()}
    for name, value in milliseconds.items():
        if not 0.0 <= value <= 1000.0:
            told = f"{name}={value:g}" if name else f"{value:g}"
            raise SwashError(f"is {told} ms, expected 0 to 1000.", channel="--delay")
    return milliseconds[""] / 1e3 if plain else {name: value / 1e3 for name, value in milliseconds.items()}
