"""A filter along a record in C, with its slopes: the same equations, traced by CasADi, differentiated in print.

Each sample is a correction, a straight line of statements, and a Runge-Kutta step of the vehicle. A run keeps the roots
that it found; slopes go along the same run again, some directions at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from types import ModuleType

import numpy as np

from swashplate.engine.emit import Tangents, fill_template, print_searches, print_statements
from swashplate.engine.equations import Equations
from swashplate.engine.graph import Graph
from swashplate.engine.roots import require_casadi
from swashplate.engine.statements import ROOTS, Statements, split, statements
from swashplate.engine.trace import traced_rates
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.following import AWAY, SHARES, STILL
from swashplate.filtering.nuisance import Nuisance
from swashplate.physics.backend import CasadiBackend

Beyond = Callable[[Statements, Sequence[int]], str]

_FOUND = ("nu", "corrected", "acting", "rest")
_READ = ("s", "y", "g", "w", "p", "k")


@dataclass(frozen=True)
class Sample:
    """What a filter makes of a sample, as a graph.

    Attributes:
        correct: CasADi function of (predicted, reading, given, what drives, numbers, rates) to (innovation, corrected,
            what acts, what of the state goes on by itself).
        pushed: places of the states whose rates are pushed by the first of what acts.
        windy: the seventh and eighth of what acts are wind.
        rated: rates are measured.
        linear: what drives goes straight from sample to sample; otherwise it is held.
    """

    correct: Graph
    pushed: Sequence[int]
    windy: bool = False
    rated: bool = False
    linear: bool = False


def filter_source(model: StochasticModel) -> str:
    """C of a vehicle in disturbed air, as `sample_source`, with predictions, and with wind a gain that follows."""
    casadi, correct = require_casadi(), correction(model)
    vehicle = model.vehicle
    sizes = (len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2, len(vehicle.state_names))
    given = [casadi.SX.sym(name, correct.size1_in(i)) for i, name in enumerate("syg")]
    beside = [casadi.SX.sym(name, size) for name, size in zip("wpk", sizes, strict=True)]
    sampled = casadi.Function("f", [*given, *beside], correct(*given), {"cse": True})
    sample = Sample(sampled, model.disturbed, windy=model.windy)
    return sample_source(model.equations, sample, partial(_beyond_a_record, model))


def sample_source(equations: Equations, sample: Sample, beyond: Beyond | None = None) -> str:
    """C of `run_along`, `run_moved`, `run_steps` and `rates_and_slopes` (`templates/filter.c`).

    Args:
        equations: that are stepped. sample: what is made of a reading.
        beyond: prints what follows in the file, from the rates without what the card alone decides, and their roots.

    Raises:
        ExportError: for equations that CasADi cannot trace or that are not printed as C.
        MissingLibraryError: without CasADi.
    """
    vehicle, correct = equations.vehicle, sample.correct
    n, m = len(vehicle.state_names), len(vehicle.input_names)
    corrected = statements(correct, precision="double", inputs=_READ)
    of_sample = Tangents({name: (f"d{name}", None) for name in ("s", "g", "p", "k")})
    correcting = [*of_sample.body(corrected.body), *of_sample.stores(corrected, dict(enumerate(_FOUND)))]
    rates = traced_rates(equations)
    source = statements(rates.function, precision="double", inputs=["x", "w", "p", *(name[:-1] for name in ROOTS)])
    of_card, rest = split(source, moving=("x[", "w[", *ROOTS), fixed="cp")
    further = beyond(rest, rates.steps) if beyond else ""
    of_inputs, rest = split(rest)
    driven = frozenset(range(m + 3))  # not the voltage
    arrays: dict[str, tuple[str, frozenset[int] | None]] = {"p": ("dp", None)}
    card = Tangents(arrays)
    card_lines = [*card.body(of_card.body), *card.stores(of_card, {0: "cp"})]
    arrays |= {"w": ("dw", driven), "cp": ("dcp", None)}
    inputs = Tangents(arrays)
    input_lines = [*inputs.body(of_inputs.body), *inputs.stores(of_inputs, {0: "c"})]
    moving = Tangents(arrays | {"x": ("dx", None), "c": ("dc", None)})
    if rates.steps:
        lines, stored = moving.rooted(rest, len(rates.steps))
    else:
        lines, stored = moving.body(rest.body), rest
    blanks = {
        "N": str(n),
        "M": str(m),
        "P": str(len(vehicle.parameter_names) + 2),
        "G": str(correct.size1_in(2)),
        "Y": str(correct.size1_in(1)),
        "S": str(correct.size1_in(0)),
        "A": str(correct.size1_out(2)),
        "D": str(len(sample.pushed)),
        "WINDY": str(int(sample.windy)),
        "RATED": str(int(sample.rated)),
        "LINEAR": str(int(sample.linear)),
        "R": str(max(1, len(rates.steps))),
        "CP": str(max(1, len(of_card.outputs))),
        "C": str(max(1, len(of_inputs.outputs))),
        "PUSHED": ", ".join(map(str, sample.pushed)),
        "CORRECT": print_statements(corrected, "double", "double", _FOUND),
        "CORRECT_MOVED": _indented(correcting),
        "OF_CARD": print_statements(of_card, "double", "double", ["cp"]),
        "OF_CARD_MOVED": _indented(card_lines),
        "OF_INPUTS": print_statements(of_inputs, "double", "double", ["c"]),
        "OF_INPUTS_MOVED": _indented(input_lines),
        "MOVING": _rates_in_c(rest, rates.steps),
        "MOVING_MOVED": _indented([*lines, *moving.stores(stored, {0: "k"})]),
        "BEYOND": further,
    }
    return fill_template("filter.c", blanks)


def _rates_in_c(code: Statements, steps: Sequence[int]) -> str:
    """Rates, by loops around their roots where there are some."""
    if steps:
        return print_searches(code, steps, real="double", precision="double", outputs=["k"])
    return print_statements(code, "double", "double", ["k"])


def _beyond_a_record(model: StochasticModel, rates: Statements, steps: Sequence[int]) -> str:
    """C of predictions (`templates/ahead.c`), and of a gain that follows where there is wind."""
    places = {name: model.vehicle.index(state) for name, state in (("NORTH", "x"), ("EAST", "y"), ("HEADING", "psi"))}
    flags = {"WINDY": int(model.windy), "ROOTED": int(bool(steps))}
    ahead = fill_template("ahead.c", {**places, **flags})
    return ahead + (_following(model, rates, steps) if model.windy else "")


def _following(model: StochasticModel, rates: Statements, steps: Sequence[int]) -> str:
    """C of a gain that follows (`templates/follow.c`), from the rates and their roots' steps."""
    names, m = model.vehicle.state_names, len(model.vehicle.input_names)
    still, windy = split(rates, moving=(f"w[{m}]", f"w[{m + 1}]", *ROOTS), fixed="ca")
    sensed = statements(sensing(model), precision="double", inputs=["s", "g"])
    read = {*(text for s in rates.body for text in s.reads), *rates.outputs.values()}
    leading = [place for place in range(len(names)) if f"x[{place}]" in read]
    blanks = {
        "AHEAD": names.index("u"),
        "HEADING": names.index("psi"),
        "NUISANCES": len(Nuisance._fields),
        "UNEXCITED": ", ".join(map(repr, model.unexcited.tolist())),
        "AWAY": ", ".join(map(repr, AWAY)),
        "SHARES": ", ".join(map(repr, SHARES)),
        "SURE": repr(STILL),
        "LED": len(leading),
        "FROM": leading[0],
        "TILL": leading[-1] + 1,
        "LEADING": ", ".join(map(str, leading)),
        "ROOTED": int(bool(steps)),
        "STILL_AIR": max(1, len(still.outputs)),
        "IN_STILL_AIR": print_statements(still, "double", "double", ["ca"]),
        "IN_WIND": _rates_in_c(windy, steps),
        "SENSE": print_statements(sensed, "double", "double", ["y", "by_s"]),
    }
    return fill_template("follow.c", blanks)


def sensing(model: StochasticModel) -> Graph:
    """(state, nuisance) to what is measured and its slopes by the state."""
    casadi = require_casadi()
    xp, n = _Symbols(casadi), len(model.vehicle.state_names)
    s, g = casadi.SX.sym("s", n + model.n_gusts + N_DISTURBANCES), casadi.SX.sym("g", len(Nuisance._fields))
    readings = model.measure(s[:n], Nuisance(*casadi.vertsplit(g)), xp)
    return casadi.Function("sense", [s, g], [casadi.densify(readings), casadi.jacobian(readings, s)], {"cse": True})


def _indented(lines: list[str]) -> str:
    return "".join(f"  {line}\n" for line in lines)


class _Symbols(CasadiBackend):
    """Expressions side by side are a column."""

    def __init__(self, casadi: ModuleType) -> None:
        super().__init__()
        self.arrays = self
        self.stack = self.concatenate = lambda parts: casadi.vertcat(*parts)


def correction(model: StochasticModel) -> Graph:
    """(predicted, reading, given) to (innovation, corrected, acting, what of the state goes on by itself).

    `given` is the gain row by row, `Nuisance` and what is left of gusts after a sample.
    """
    casadi = require_casadi()
    xp = _Symbols(casadi)
    n, g = len(model.vehicle.state_names), model.n_gusts
    ends = np.cumsum([n, g, N_DISTURBANCES]).tolist()
    sizes = [ends[-1] * model.n_outputs, len(Nuisance._fields), g]
    s, y, given = (
        casadi.SX.sym(a, size) for a, size in zip("syg", (ends[-1], model.n_outputs, sum(sizes)), strict=True)
    )
    rows, nuisance, fade = casadi.vertsplit(given, [0, *np.cumsum(sizes).tolist()])
    K = casadi.reshape(rows, model.n_outputs, ends[-1]).T
    by_state, by_gust, by_drift = casadi.vertsplit(K, [0, *ends])
    x, gust, drift = casadi.vertsplit(s, [0, *ends])
    gain, state = FilterGain(by_state, by_gust, by_drift, None), FilterState(x, gust, drift)
    after, innovation = model.correct(state, y, gain, Nuisance(*casadi.vertsplit(nuisance)), xp)
    results = [
        innovation,
        casadi.vertcat(*after),
        model.acting(after, xp),
        casadi.vertcat(fade * after.gust, after.drift),
    ]
    return casadi.Function("f", [s, y, given], [casadi.densify(result) for result in results], {"cse": True})
