"""How texts of the command line and values of a settings file become what a field of a question holds.

A field's annotation names its language: `Band` is read from "0.1-10", `Values` from "mass=0.3" (repeated), `Names` from
"p,q". What already is what it means (a tuple, a vehicle, a flight) is taken as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from swashplate.api.judging import (
    judge_bands,
    judge_delays,
    judge_environment,
    judge_flag,
    judge_mapping,
    judge_names,
    judge_noise,
    judge_number,
    judge_numbers,
    judge_object,
    judge_speeds,
    judge_start,
    judge_whole,
    judge_wind,
)
from swashplate.errors import SwashError

Names: TypeAlias = Sequence[str] | str
Texts: TypeAlias = Sequence[str] | str
Numbers: TypeAlias = Sequence[float]
Speeds: TypeAlias = Sequence[float] | float | str
Wind: TypeAlias = Sequence[float]
Band: TypeAlias = tuple[float, float]
Stretches: TypeAlias = Sequence[tuple[float, float]]
Values: TypeAlias = Mapping[str, float]
Start: TypeAlias = Any
"""A trim, or states by name."""
Noises: TypeAlias = Any
"""A noise, or numbers of it by name."""
Switches: TypeAlias = Mapping[str, Any]
Words: TypeAlias = Mapping[str, str]
Renamed: TypeAlias = Mapping[str, str] | Sequence[str] | str
Bands: TypeAlias = Mapping[str, Band] | Band
Delays: TypeAlias = Mapping[str, float] | float
Limits: TypeAlias = Mapping[str, float]
Paths: TypeAlias = Sequence[Path] | Path
Priors: TypeAlias = Any
"""A card or its file, or means and standard deviations by name, the card's file under the name ""."""
Air: TypeAlias = Any
"""An `Environment`, or numbers of it by name."""
Logs: TypeAlias = Any
"""A flight, its file or a data set's name, or several."""
FlightLimits: TypeAlias = Any
Gusts: TypeAlias = Any
Pilot: TypeAlias = Any
"""A controller, or its file."""
Fitted: TypeAlias = Any
"""What an identification found, or its file."""
Judged: TypeAlias = Any
"""A validation, or its file."""
Drawn: TypeAlias = int | Sequence[Any]
"""How many models are drawn from a fit, or the models."""
Rule: TypeAlias = str | float
Motion: TypeAlias = Any
"""A maneuver, or its description."""
GainsFile: TypeAlias = Mapping[str, float] | Path
Battery: TypeAlias = tuple[float, float]
Log: TypeAlias = Any
"""One of them."""
Aircraft: TypeAlias = Any
"""A vehicle, its name, or the file of its card or model."""
Things: TypeAlias = Any
"""Objects, or files and names of them."""


@dataclass(frozen=True)
class Language:
    """How a field is given.

    Attributes:
        read: its value from a text, or from a list of them where `repeated`; called with the field's name too.
        repeated: whether the option may be given several times.
        metavar: of its option.
        kind: "bool", "int", "float", "path" or "text": what a shell is told.
        judge: what no value may be, however it was given; called as `read`.
    """

    read: Callable[[Any, str], Any]
    repeated: bool = False
    metavar: str = ""
    kind: str = "text"
    judge: Callable[[Any, str], Any] | None = None

    def taken(self, value: Any, *, called: str) -> Any:
        """A value of Python, of a settings file or of a line as what the field holds."""
        made = self._taken(value, called)
        return made if self.judge is None or made is None else self.judge(made, called)

    def _taken(self, value: Any, called: str) -> Any:
        if value is None or isinstance(value, bool):
            return value
        listed = value if isinstance(value, list | tuple) else (value,)
        if self.judge is not None and any(isinstance(one, str) and not one.strip() for one in listed):
            raise SwashError("is empty.", channel=called, hint="Leave it out for what is usual.")
        if isinstance(value, str | Path):
            return self.read([str(value)] if self.repeated else str(value), called)
        if isinstance(value, list | tuple) and value and self.repeated and all(isinstance(v, str) for v in value):
            return self.read(list(value), called)
        if isinstance(value, list | tuple) and not self.repeated and value and all(isinstance(v, str) for v in value):
            return self.read(",".join(value), called)
        return tuple(value) if isinstance(value, list | Iterator) else value


def language_of(annotation: str, *, choices: tuple[str, ...] = ()) -> Language:
    """The language of a field by its annotation as it is written."""
    return _LANGUAGES[annotation.removesuffix(" | None")] if not choices else _LANGUAGES["str"]


# ---- the little languages ----------------------------------------------------------------------------------------
def numbers(text: str, called: str, *, count: int | None = None) -> list[float]:
    """Finite numbers, separated by commas."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or not all(map(math.isfinite, values)) or (count is not None and len(values) != count):
        several = "numbers" if count is None else f"{count} numbers"
        expected = "a number" if count == 1 else f"{several} separated by commas"
        raise SwashError(f"'{text}' is not {expected}.", channel=called)
    return values


def names(text: str, called: str = "") -> tuple[str, ...]:
    """Names, separated by commas."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


_EXAMPLES = {"--unit": "phi=deg", "--vary": "mass=5%", "--truth": "mass=0.36", "--prior": "tau_f_upper=1.6,0.3"}


def assignments(texts: Sequence[str], called: str) -> dict[str, str]:
    """`name=value`, repeated, by name."""
    made: dict[str, str] = {}
    twice = []
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            example = _EXAMPLES.get(called, "mass=0.333")
            raise SwashError(f"'{text}' is not NAME=VALUE.", channel=called, hint=f"Example: {called} {example}")
        twice += [name] if name in made else []
        made[name] = value
    if twice:
        raise SwashError(
            f"{', '.join(sorted(set(twice)))} is given twice.", channel=called, hint="Give each name once."
        )
    return made


def numbers_by_name(texts: Sequence[str], called: str) -> dict[str, float]:
    """`name=number`, repeated, by name."""
    return {name: numbers(value, called, count=1)[0] for name, value in assignments(texts, called).items()}


def limits_by_name(text: str, called: str) -> dict[str, float]:
    """`name=number,name=number` by name."""
    return numbers_by_name([part for part in text.split(",") if part.strip()], called)


def _switches(texts: Sequence[str], called: str) -> dict[str, Any]:
    """`name=value`: numbers as such, true and false as such, others as texts."""
    return {name: _scalar(value) for name, value in assignments(texts, called).items()}


def _scalar(text: str) -> Any:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text


def band(text: str, called: str) -> tuple[float, float]:
    """`0.1-10`, also with Hz, as two rising numbers."""
    try:
        low, high = (float(part) for part in text.lower().removesuffix("hz").replace(",", "-").split("-"))
    except ValueError:
        low = high = math.nan
    if not 0.0 < low < high < math.inf:
        raise SwashError(f"'{text}' is not LOW-HIGH in Hz.", channel=called, hint=f"Example: {called} 0.1-10")
    return low, high


def _bands(texts: Sequence[str], called: str) -> dict[str, tuple[float, float]]:
    """`0.1-10` for all pairs (under the name ""), `p/lateral=0.5-12` for some."""
    made: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, equals, limits = text.rpartition("=")
        name = name.strip()
        if equals and (not name or name in made):
            raise SwashError(f"'{text}' gives no pair, or one that is given twice.", channel=called)
        if not equals and "" in made:
            hint = f"Say which pair: {called} p/lateral=0.5-12"
            raise SwashError("two bands are given for all pairs.", channel=called, hint=hint)
        made[name] = band(limits, called)
    return made


def _renamed(text: str, called: str) -> dict[str, str]:
    """`p,az=az_sid` as names of the result and the log's channels behind them."""
    pairs: dict[str, str] = {}
    for part in names(text):
        name, _, source = part.partition("=")
        name, source = name.strip(), source.strip() or name.strip()
        if not name or not source or name in pairs:
            raise SwashError(f"'{part}' is no new CHANNEL or NAME=CHANNEL.", channel=called)
        pairs[name] = source
    return pairs


_RANGE_POINTS = 11


def speeds(text: str, called: str = "--speed") -> tuple[float, ...]:
    """One speed, or a range A-B or A-B/STEP, ascending [m/s]."""
    number = r"\d+(?:\.\d*)?|\.\d+"
    if match := re.fullmatch(rf"({number})-({number})(?:/({number}))?", text.strip()):
        low, high = float(match[1]), float(match[2])
        step = float(match[3]) if match[3] else (high - low) / (_RANGE_POINTS - 1)
        if not (low < high and step > 0.0 and (high - low) / step <= 500):
            raise SwashError(f"'{text}' is no ascending range of at most 500 speeds.", channel=called)
        return tuple(low + i * step for i in range(int((high - low) / step + 1e-9) + 1))
    return (numbers(text, called, count=1)[0],)


def _stretches(texts: Sequence[str], called: str) -> tuple[tuple[float, float], ...]:
    return tuple((a, b) for a, b in (numbers(text, called, count=2) for text in texts))


def _delays(texts: Sequence[str], called: str) -> dict[str, float] | float:
    """`20` for all inputs, or `NAME=20` each [ms]."""
    plain = len(texts) == 1 and "=" not in texts[0]
    return numbers(texts[0], called, count=1)[0] if plain else numbers_by_name(texts, called)


def in_seconds(milliseconds: Any) -> Any:
    """One number, or several by name; None where there is none."""
    if isinstance(milliseconds, Mapping):
        return {name: value / 1e3 for name, value in milliseconds.items()}
    return None if milliseconds is None else milliseconds / 1e3


def _priors(texts: Sequence[str], called: str) -> dict[str, Any]:
    """`CARD` (under the name "") and `name=mean,sigma`."""
    cards = [text for text in texts if "=" not in text]
    if len(cards) > 1:
        raise SwashError(f"{' and '.join(cards)} are two cards.", channel=called, hint="Give one.")
    pairs = assignments([text for text in texts if "=" in text], called)
    made: dict[str, Any] = {name: tuple(numbers(text, called, count=2)) for name, text in pairs.items()}
    return made | ({"": cards[0]} if cards else {})


def _battery(text: str, called: str) -> tuple[float, float]:
    try:
        first, last = numbers(text.replace("-", ","), called, count=2)
    except SwashError:
        hint = "Example: 12.5-10.5"
        raise SwashError(f"is '{text}', expected the voltages at start and end.", channel=called, hint=hint) from None
    return first, last


def _number(text: str, called: str) -> float:
    return numbers(text, called, count=1)[0]


def _whole(text: str, called: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise SwashError(f"'{text}' is not a whole number.", channel=called) from None


def _flag(text: str, called: str) -> bool:
    if text.lower() not in ("true", "false"):
        raise SwashError(f"'{text}' is neither true nor false.", channel=called)
    return text.lower() == "true"


def _same(value: Any, called: str) -> Any:
    return value


_LANGUAGES: Mapping[str, Language] = {
    "str": Language(_same),
    "bool": Language(_flag, kind="bool", judge=judge_flag),
    "int": Language(_whole, kind="int", metavar="N", judge=judge_whole),
    "float": Language(_number, kind="float", metavar="NUMBER", judge=judge_number),
    "Path": Language(lambda text, _: Path(text), kind="path", metavar="FILE"),
    "Judged": Language(lambda text, _: Path(text), kind="path", metavar="FILE"),
    "Drawn": Language(_whole, kind="int", metavar="N"),
    "Rule": Language(_same),
    "Fitted": Language(lambda text, _: Path(text), kind="path", metavar="FILE", judge=judge_object),
    "Motion": Language(_same, metavar="SPEC"),
    "Pilot": Language(lambda text, _: Path(text), kind="path", metavar="FILE"),
    "GainsFile": Language(lambda text, _: Path(text), kind="path", metavar="FILE"),
    "Paths": Language(lambda texts, _: tuple(map(Path, texts)), repeated=True, kind="path", metavar="FILE"),
    "Names": Language(names, metavar="NAME,...", judge=judge_names),
    "Texts": Language(lambda texts, _: tuple(texts), repeated=True, metavar="TEXT", judge=judge_names),
    "Numbers": Language(lambda text, called: tuple(numbers(text, called)), metavar="NUMBER,..."),
    "Speeds": Language(speeds, metavar="V", judge=judge_speeds),
    "Wind": Language(lambda text, called: tuple(numbers(text, called, count=3)), metavar="N,E,D", judge=judge_wind),
    "Band": Language(band, metavar="LOW-HIGH", judge=judge_bands),
    "Bands": Language(_bands, repeated=True, metavar="[PAIR=]LOW-HIGH", judge=judge_bands),
    "Stretches": Language(_stretches, repeated=True, metavar="START,STOP"),
    "Air": Language(numbers_by_name, repeated=True, metavar="NAME=VALUE", judge=judge_environment),
    "Values": Language(numbers_by_name, repeated=True, metavar="NAME=VALUE", judge=judge_numbers),
    "Start": Language(numbers_by_name, repeated=True, metavar="NAME=VALUE", judge=judge_start),
    "Noises": Language(numbers_by_name, repeated=True, metavar="NAME=VALUE", judge=judge_noise),
    "Limits": Language(limits_by_name, metavar="NAME=VALUE,...", judge=judge_numbers),
    "Switches": Language(_switches, repeated=True, metavar="NAME=VALUE", judge=judge_mapping),
    "Words": Language(assignments, repeated=True, metavar="NAME=VALUE", judge=judge_mapping),
    "Renamed": Language(_renamed, metavar="NAME[=CHANNEL],..."),
    "Delays": Language(_delays, repeated=True, metavar="MS", judge=judge_delays),
    "Priors": Language(_priors, repeated=True, metavar="CARD|NAME=MEAN,SIGMA"),
    "Logs": Language(lambda texts, _: tuple(texts), repeated=True, metavar="LOG", judge=judge_object),
    "FlightLimits": Language(assignments, repeated=True, metavar="NAME=VALUE"),
    "Gusts": Language(_same, metavar="none|indoor|WIND"),
    "Battery": Language(_battery, metavar="FROM-TO"),
    "Log": Language(_same, metavar="LOG", judge=judge_object),
    "Aircraft": Language(_same, metavar="NAME|FILE", judge=judge_object),
    "Things": Language(lambda texts, _: tuple(texts), repeated=True, metavar="FILE", judge=judge_object),
}
"""By annotation."""
