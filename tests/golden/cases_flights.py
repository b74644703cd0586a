"""Golden cases of fits in time: the real flights both ways, simulated flights, other people's records."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import swashplate as sp

from . import extract
from .case import Values, apart, case
from .inner import equation_error

AUGUST, JULY = "coax56/flight_2011-08-01_vertical", "coax56/flight_2011-07-25_hover_crash"


def real(name: str) -> Any:
    """A real flight as README and docs/real-flights.md condition it."""
    return sp.read(name).condition(rate=100.0, cutoff=0.0)


def one_way(learnt: str, predicted: str) -> Values:
    """What one real flight teaches and how it predicts the other one."""
    fit = sp.identify(sp.vehicle("coax"), real(learnt))
    validation = sp.validate(fit, real(predicted))
    told = {f"validation.{name}": value for name, value in extract.of_validation(validation).items()}
    return extract.of_fit(fit) | told


@case(data=["coax56"])
def real_august_predicts_july(folder: Path) -> Values:
    return one_way(AUGUST, JULY)


@case(data=["coax56"])
def real_july_predicts_august(folder: Path) -> Values:
    return one_way(JULY, AUGUST)


@case(data=["coax56"])
def real_fit_of_six_with_ties_and_priors(folder: Path) -> Values:
    """Few parameters, a tie, a prior and one held, on half of the August flight."""
    whole = real(AUGUST)
    fit = sp.identify(
        sp.vehicle("coax"),
        whole.between(whole.start, whole.start + 20.0),
        free=["linkage_lower", "a_alpha_v_linear", "tau_f_upper", "hub_stiffness_lower"],
        tie=["a_beta_u_linear = a_alpha_v_linear", "hub_stiffness_upper = 0.25 * hub_stiffness_lower"],
        fix={"mass": 0.305},
        prior={"tau_f_upper": (1.0, 0.2)},
    )
    return extract.of_fit(fit)


@case(data=["coax56"])
def real_conditioning(folder: Path) -> Values:
    """Both flights at 100 Hz, and with a low-pass at 50 Hz; the record of what was done beside the samples."""
    found: Values = {}
    for name, where in (("august", AUGUST), ("july", JULY)):
        raw = sp.read(where)
        for label, flight in (
            ("raw", raw),
            ("100", raw.condition(rate=100.0, cutoff=0.0)),
            ("50", raw.condition(rate=50.0, cutoff=8.0)),
        ):
            one = extract.of_flight(flight, most=5)
            one["segments"] = [float(t) for pair in flight.segments for t in pair]
            found |= {f"{name}.{label}.{key}": value for key, value in one.items()}
    return found


def hover_flight() -> Any:
    """10 s of hover with independent roll and pitch inputs, as simulated motion capture sees it."""
    coax = sp.vehicle("coax")
    flight = sp.simulate(coax, "multisine:roll+pitch,0.4-4Hz,8s,0.1", controller=sp.hover_hold, lead=1, tail=1)
    return sp.observe(flight, coax, sensors=sp.Sensors(), seed=3).condition(rate=100.0, cutoff=0.0)


def simulated(method: str, **how: Any) -> Values:
    """A fit of a simulated flight, started beside the truth."""
    start = sp.vehicle("coax").with_values({"tau_f_upper": 1.3, "linkage_lower": 0.75})
    fit = sp.identify(start, hover_flight(), free=["tau_f_upper", "linkage_lower"], method=method, **how)
    return extract.of_fit(fit)


@case()
def simulated_output_error(folder: Path) -> Values:
    return simulated("output-error")


@case()
def simulated_filter_error(folder: Path) -> Values:
    return simulated("filter-error")


@case()
def simulated_filter_error_with_wind(folder: Path) -> Values:
    return simulated("filter-error", wind=True)


@case(data=["fvsysid"])
def hfb320_filter_error(folder: Path) -> Values:
    """A business jet in turbulence, its own equations and sensors, from published start values."""
    import hfb320

    rows = np.loadtxt(data() / "fvsysid" / "hfb320_1_10.asc")
    names = ("elevator", "pressure", "thrust", "V", "alpha", "theta", "q", "qdot", "ax", "az")
    seen = dict(zip(names, rows[:, 1:11].T, strict=True))
    flight = hfb320.flight({n: seen[n] for n in (*hfb320.Inputs._fields, *hfb320.OUTPUTS)})
    how = {"free": list(hfb320.START), "outputs": hfb320.OUTPUTS, "environment": hfb320.AIR}
    found = extract.of_time_fit(sp.identify(hfb320.hfb320(), flight, **how))
    for method in ("output-error", "prediction-error"):
        other = extract.of_time_fit(sp.identify(hfb320.hfb320(), flight, method=method, iterations=15, **how))
        found |= {f"{method}.{name}": value for name, value in other.items()}
    return found


@case(data=["fvsysid"])
def unstable_aircraft(folder: Path) -> Values:
    """Jategaonkar's unstable aircraft in time and over frequencies, and its equation errors."""
    from .inner import Flight, stream

    rows = np.array((data() / "fvsysid" / "unStabAC_sim.asc").read_text(encoding="utf-8").split(), dtype=float)
    time, _, w, q, elevator, az = rows.reshape(251, 6).T
    flight = Flight({"uniform": stream(time, {"w": w, "q": q, "elevator": elevator, "az": az})})
    text = """
        kind = "state-space"
        name = "unstable"
        [states]
        w = "m/s"
        q = "rad/s"
        [inputs]
        elevator = "rad"
        [equations]
        w = {w = "Zw", q = "U0 + Zq", elevator = "Zde"}
        q = {w = "Mw", q = "Mq", elevator = "Mde"}
        [outputs.w]
        of = {w = "1"}
        [outputs.q]
        of = {q = "1"}
        [outputs.az]
        of = {w = "Zw", q = "Zq", elevator = "Zde"}
        [parameters]
        U0 = {value = 44.5695, fixed = true}
        Zq = {value = -1.4768, fixed = true}
        Zw = {value = -1.0}
        Zde = {value = -5.0}
        Mw = {value = 0.1}
        Mq = {value = -3.0}
        Mde = {value = -10.0}
        """
    (folder / "unstable.toml").write_text(text, encoding="utf-8")
    model = sp.structure(folder / "unstable.toml")
    found: Values = {}
    ways = {"output-error": {}, "filter-error": {}, "lasting-gusts": {"method": "filter-error", "gusts": "lasting"}}
    for name, how in ways.items():
        one = extract.of_time_fit(sp.identify(model, flight, shifts=False, **{"method": name, **how}))
        found |= {f"{name}.{entry}": value for entry, value in one.items()}
    errors = equation_error(az, np.column_stack([w, q, elevator]), ["w", "q", "de"], dt=0.05, band=(0.05, 2.0))
    found |= apart("equation.values", (errors[n] for n in ("w", "q", "de")))
    return found | apart("equation.sigmas", errors.sigmas)


def data() -> Path:
    """The folder of the shared data."""
    from .freeze import data_folder

    folder = data_folder()
    assert folder is not None
    return folder
