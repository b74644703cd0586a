"""Options that several verbs share, and their little languages: `name=value`, `name=mean,sigma`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from swashplate.errors import SwashError


def _vehicle_names(incomplete: str) -> list[str]:
    """Packaged vehicles for shell completion (files are completed by the shell itself)."""
    from importlib import resources

    files = (resources.files("swashplate.models") / "data").iterdir()
    names = sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))
    return [name for name in names if name.startswith(incomplete)]


def _flight_names(incomplete: str) -> list[str]:
    """Registered flights for shell completion (files are completed by the shell itself)."""
    from swashplate.flights.datasets import REGISTRY

    names = [f"{name}/{Path(file).stem}" for name, data in REGISTRY.items() for file in data.files if "flight" in file]
    return [name for name in names if name.startswith(incomplete)]


_FLIGHT = (
    "a log, or a data set's file as coax56/flight_2011-08-01_vertical; FILE@5-30 takes the seconds 5 to 30, "
    "FILE#2 the second log of a Blackbox file"
)

VehicleName = Annotated[
    str, typer.Option("--vehicle", help="A vehicle's name, or a card or model file.", autocompletion=_vehicle_names)
]
ModelName = Annotated[
    str, typer.Option("--model", help="A model file, or a vehicle's name.", autocompletion=_vehicle_names)
]
Flights = Annotated[
    list[str], typer.Option("--flight", help=f"Flight: {_FLIGHT}. May be repeated.", autocompletion=_flight_names)
]
HoldOut = Annotated[
    list[str] | None,
    typer.Option("--hold-out", help="Flight that the fit never sees, to validate on.", autocompletion=_flight_names),
]
HorizonAhead = Annotated[
    str | None,
    typer.Option(
        "--horizon",
        metavar="FIRST,LAST",
        help="After maximum likelihood, minimise errors FIRST, 2 FIRST, ... LAST seconds ahead, e.g. 0.25,1.",
    ),
]
CloseLoop = Annotated[
    str,
    typer.Option(
        "--close-loop",
        metavar="AXES",
        help="Predict the hold-outs also with the controller of these axes (yaw,heave), as the first seconds tell it, "
        "in the place of its recorded command.",
    ),
]
FlightName = Annotated[str, typer.Argument(metavar="FLIGHT", help=f"{_FLIGHT}.", autocompletion=_flight_names)]
OutFolder = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="DIR", help="Folder for the results; it is made if missing.")
]
Rate = Annotated[float, typer.Option("--rate", help="Conditioned rate [Hz].", min=1.0, max=2000.0)]
Cutoff = Annotated[
    float,
    typer.Option(
        "--cutoff", help="Low-pass on all channels [Hz]; 0 for none: the noise is modelled, not filtered.", min=0.0
    ),
]
Mapping = Annotated[
    Path | None, typer.Option("--mapping", help="TOML file that says which columns are which channels.")
]
Units = Annotated[
    list[str] | None, typer.Option("--unit", metavar="NAME=UNIT", help="Unit of a channel or field of the log.")
]
BadStamps = Annotated[
    bool, typer.Option("--drop-bad-stamps", help="Leave out samples whose time repeats or goes backwards.")
]
AsLogged = Annotated[
    bool,
    typer.Option("--as-logged", help="Use channels as they are logged, even where they contradict each other."),
]
Estimate = Annotated[
    list[str] | None,
    typer.Option(
        "--estimate",
        metavar="NAMES|EQUATION",
        help="Estimate while it flies: parameters of the model (mass), or an equation as of `swash track`. Repeatable.",
    ),
]
Truth = Annotated[
    list[str] | None,
    typer.Option(
        "--truth",
        metavar="NAME=VALUE",
        help="What flies has this number instead of the card's: for --estimate to find. Repeatable.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON instead of tables.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no tables: files and exit code only.")]


_EXAMPLES = {
    "--unit": "phi=deg",
    "--option": "bar=true",
    "--vary": "mass=5%",
    "--truth": "mass=0.36",
    "--prior": "tau_f_upper=1.6,0.3",
}


def split_assignment(text: str, *, option: str) -> tuple[str, str]:
    """`name=value` as its two sides."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        example = _EXAMPLES.get(option, "mass=0.333")
        raise SwashError(f"'{text}' is not NAME=VALUE.", channel=option, hint=f"Example: {option} {example}")
    return name, value


def names(text: str) -> tuple[str, ...]:
    """Names, separated by commas."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def numbers(text: str, *, option: str, count: int | None = None) -> list[float]:
    """Finite numbers, separated by commas."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or not all(map(math.isfinite, values)) or (count is not None and len(values) != count):
        several = "numbers" if count is None else f"{count} numbers"
        expected = "a number" if count == 1 else f"{several} separated by commas"
        raise SwashError(f"'{text}' is not {expected}.", channel=option)
    return values


def _once(pairs: Sequence[tuple[str, str]], *, option: str) -> list[tuple[str, str]]:
    names = [name for name, _ in pairs]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise SwashError(f"{', '.join(doubled)} is given twice.", channel=option, hint="Give each name once.")
    return list(pairs)


def assignments(texts: Sequence[str] | None, *, option: str) -> dict[str, str]:
    """Repeated `name=value` by name."""
    return dict(_once([split_assignment(text, option=option) for text in texts or ()], option=option))


def numbers_by_name(texts: Sequence[str] | None, *, option: str) -> dict[str, float]:
    """Repeated `name=number` by name."""
    by_name = assignments(texts, option=option)
    return {name: numbers(text, option=option, count=1)[0] for name, text in by_name.items()}


def fixed_values(texts: Sequence[str] | None) -> dict[str, float]:
    """`--fix name=value`, repeated."""
    return numbers_by_name(texts, option="--fix")


def seconds_ahead(text: str | None) -> tuple[float, ...] | None:
    """`--horizon first,last`, or one number."""
    return None if text is None else tuple(numbers(text, option="--horizon"))


def prior_card_name(texts: Sequence[str] | None) -> tuple[str | None, list[str]]:
    """The card among repeated `--prior CARD` and `--prior name=mean,sigma` (None: none), and the others."""
    cards = [text for text in texts or () if "=" not in text]
    if len(cards) > 1:
        raise SwashError(f"{' and '.join(cards)} are two cards.", channel="--prior", hint="Give one.")
    return (cards[0] if cards else None), [text for text in texts or () if "=" in text]


def prior_values(texts: Sequence[str] | None) -> dict[str, tuple[float, float]]:
    """`--prior name=mean,sigma`, repeated."""
    pairs = {
        name: numbers(text, option="--prior", count=2) for name, text in assignments(texts, option="--prior").items()
    }
    return {name: (mean, sigma) for name, (mean, sigma) in pairs.items()}
