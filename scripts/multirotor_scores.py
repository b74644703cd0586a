"""Open-loop predictions of multirotor flights that no fit saw, beside rivals trained on the flights of the fit.

    python scripts/multirotor_scores.py --model LABEL=MODEL.toml ... --fit FLIGHT ... --on FLIGHT ... [--new FLIGHT ...]
    python scripts/multirotor_scores.py --heave PART=MODEL.toml ... --on FLIGHT ... [--new FLIGHT ...]

MODEL.toml is what `swash identify --vehicle crazyflie ... --out FOLDER` wrote; a flight may have a window (FILE@8-30).
Predictions start every 0.1 s, run at 100 Hz on the logged commands and voltage, and are scored by mean absolute errors
over the axes up to 0.5 s, and by fit % after 0.5, 1 and 2 s. A model starts from its own observer, which has seen the
flight up to the start; everything else from measured motion. The first five seconds of each flight tell a model that
flight's constants; nothing is scored there. "Textbook" is the card before the identification. `--heave` tells what a
model says of the acceleration along body z (`multirotor_heave`), in a table of its name. `--new`: flights of kinds that
no fit saw, in tables of their own. `--page FILE` puts the tables into a page, each between <!-- scores: NAME --> and
<!-- end -->. The trees need scikit-learn.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from multirotor_heave import HEADS, Acting, Heave, heave
from multirotor_rivals import RIVALS, Motion, Rival, motion
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import swashplate as sp
from swashplate.arrays import Array, lengthened
from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbed_model import Nuisance, stochastic_model
from swashplate.filtering.nuisance import PUSHES
from swashplate.flights.readers.read import read
from swashplate.identification.core.records import Record, records
from swashplate.identification.time.calibration import CALIBRATION, calibrate
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.dynamics import jax_backend
from swashplate.validation.metrics import fit_percent
from swashplate.validation.prediction import naive, observed, predict
from swashplate.validation.validate import observer_of, started_from

AHEAD, EVERY = 50, 10
"""Samples of 10 ms: how far ahead mean errors go, and between starts."""
SHOWN = (10, 50)
FITS = (50, 100, 200)
"""Samples after which fit % is told."""
GROUPS = {
    "position [m]": slice(0, 3),
    "velocity [m/s]": slice(3, 6),
    "attitude [deg]": slice(6, 9),
    "rates [rad/s]": slice(9, 12),
}
MOTIONS = {
    "horizontal (u, v)": (3, 4),
    "heave (w)": (5,),
    "tilt (φ, θ)": (6, 7),
    "tilting (p, q)": (9, 10),
    "heading (ψ)": (8,),
    "turning (r)": (11,),
}
"""Channels whose mean fit is told together."""
BODY = len(PREDICTED)
EDGE = 10
"""Samples at a record's end whose measured motion has too few samples around it."""
Places = NDArray[np.intp]


@partial(jax.jit, static_argnums=(0, 1))
def flown(
    model: Any, of: Any, body: Any, inner: Any, inputs: Any, voltage: Any, par: Any, push: Any, starts: Any
) -> Any:
    """States after each start (s, FITS[-1], 12) from measured motion, and the specific force along it (n, 3)."""
    vehicle = of.vehicle

    def along(inside: Any, here: Any) -> Any:
        row, u, volts = here
        after = model.step(jnp.concatenate([row, inside]), push, u, par, volts)
        return after[BODY:], inside

    _, inside = jax.lax.scan(along, inner, (body, inputs, voltage))

    def felt(row: Any, inside: Any, u: Any, volts: Any) -> Any:
        x = jnp.concatenate([row, inside])
        nested = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
        told = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
        force = vehicle.specific_force(nested, told, par, Environment(voltage=volts, air_density=1.2), jax_backend())
        return jnp.stack(force) + push[:3]

    def run(start: Any) -> Any:
        def sample(x: Any, k: Any) -> Any:
            x = model.step(x, push, inputs[k], par, voltage[k])
            return x, x[:BODY]

        first = jnp.concatenate([body[start], inside[start]])
        return jax.lax.scan(sample, first, start + jnp.arange(FITS[-1]))[1]

    return jax.vmap(run)(starts), jax.vmap(felt)(body, inside, inputs, voltage)


def open_loop(vehicle: Vehicle, record: Record, nuisance: Nuisance, starts: Places) -> tuple[Array, Array]:
    """Predictions (s, FITS[-1], 12) from measured motion and the specific force (n, 3) of a vehicle."""
    model = stochastic_model(vehicle, record.output_names, record.dt)
    body, par = measured_states(record, nuisance), jax.tree.map(jnp.asarray, vehicle.values())
    reaching = commands(vehicle, record.dt, jnp.asarray(record.inputs), nuisance)
    told = vehicle.inputs(*(reaching[0][i] for i in range(len(vehicle.input_names))))
    settled = vehicle.traits.settled
    assert settled is not None
    inside = settled(told, vehicle.values(), record.voltage[0], None, float(record.time[0]))
    inner = jnp.stack([jnp.asarray(inside[name]) for name in vehicle.state_names[BODY:]])
    push = jnp.array([float(getattr(nuisance, name)) for name in PUSHES])
    voltage = jnp.asarray(record.voltage)
    paths = flown(model, model.equations, jnp.asarray(body), inner, reaching, voltage, par, push, starts)
    return np.asarray(paths[0]), np.asarray(paths[1])


def in_the_room(states: Array) -> Array:
    """States with velocities in local axes and angles in degrees, shape (..., 12)."""
    out = np.array(states)
    angles = out[..., 6:9].reshape(-1, 3)
    turned = Rotation.from_euler("ZYX", angles[:, ::-1]).apply(out[..., 3:6].reshape(-1, 3))
    out[..., 3:6] = turned.reshape(out[..., 3:6].shape)
    out[..., 6:9] = np.degrees(out[..., 6:9])
    return out


class Scored(NamedTuple):
    """Absolute errors (s, AHEAD, 4): the mean over the axes of each group; and by horizon of `FITS` predicted, true and
    starting states (s, 12) as `validate` compares them."""

    errors: Array
    fits: tuple[tuple[Array, Array, Array], ...]


def scored(states: Array, truth: Array, starts: Places) -> Scored:
    """Predictions (s, FITS[-1], 12) beside what came."""
    later = truth[starts[:, None] + 1 + np.arange(AHEAD)]
    off = in_the_room(states[:, :AHEAD]) - in_the_room(later)
    off[..., 6:9] = (off[..., 6:9] + 180.0) % 360.0 - 180.0
    errors = np.stack([np.abs(off[..., part]).mean(axis=-1) for part in GROUPS.values()], axis=-1)
    fits = []
    for ahead in FITS:
        at = np.flatnonzero(starts + ahead < len(truth) - EDGE)
        fits.append((states[at, ahead - 1], truth[starts[at] + ahead], truth[starts[at]]))
    return Scored(errors, tuple(fits))


def of_files(names: Sequence[str], vehicle: Vehicle) -> list[tuple[Record, Array]]:
    """Records of at least calibration and a prediction, and what the accelerometer read along z at their samples."""
    shortest, made = CALIBRATION + 2.0 * AHEAD * 0.01, []
    for flight in (read(name).condition(rate=100.0, cutoff=0.0) for name in names):
        for record in records(flight, vehicle):
            if record.time[-1] - record.time[0] > shortest:
                made.append((record, np.interp(record.time, flight.time("az"), flight.values("az"))))
    return made


def seen(record: Record, *, beyond: int = 0) -> Motion:
    """A record as the rivals see it, with its last commands held for some samples."""
    body = measured_states(record, Nuisance())
    inputs, voltage = (lengthened(rows, len(rows) + beyond) for rows in (record.inputs, record.voltage))
    return motion(lengthened(body, len(body) + beyond), inputs, voltage, record.dt, calibration=CALIBRATION)


def along_z(vehicle: Vehicle, record: Record, felt: Array) -> Heave:
    """What can be explained of a record's acceleration along body z, and what the model explains."""
    noise, prior = observer_of(vehicle)
    nuisance, first = calibrate(vehicle, record, noise=noise, prior=prior), round(CALIBRATION / record.dt)
    seen = observed(vehicle, record, noise=noise, nuisance=nuisance, beyond=0).filtered
    acting = Acting(seen.drift[:, 2], seen.gust[:, 2], float(noise.tau_gust_vertical or noise.tau_gust_force))
    body = measured_states(record, nuisance)
    force = open_loop(vehicle, record, nuisance, np.array([first]))[1][:, 2] - float(nuisance.push_w)
    return heave(vehicle, record, nuisance, body, force, acting, felt, first)


def compare(
    models: dict[str, Vehicle], rivals: dict[str, Rival], pieces: Sequence[tuple[Record, Array]]
) -> dict[str, list[Scored]]:
    """Every predictor on every record."""
    textbook = {"textbook quadrotor (the card)": started_from(next(iter(models.values())))}
    by_label: dict[str, list[Scored]] = {}
    for record, _ in pieces:
        starts = np.arange(round(CALIBRATION / record.dt), record.time.size - AHEAD - EDGE, EVERY)
        plain = measured_states(record, Nuisance())
        for kind, label in (("hold", "hold"), ("rates", "constant velocity and rates")):
            ahead = [naive(plain, starts, k, record.dt, kind=kind) for k in range(1, FITS[-1] + 1)]
            by_label.setdefault(label, []).append(scored(np.stack(ahead, axis=1), plain, starts))
        for label, vehicle in (textbook | models).items():
            noise, prior = observer_of(vehicle)
            nuisance = calibrate(vehicle, record, noise=noise, prior=prior)
            body = measured_states(record, nuisance)
            if label in models:
                told = predict(vehicle, record, noise=noise, nuisance=nuisance, horizon=FITS[-1] * record.dt,
                               every=EVERY * record.dt, settling=CALIBRATION)  # fmt: skip
                states = told.states[np.isin(told.starts, starts)]
            else:
                states = open_loop(vehicle, record, nuisance, starts)[0]
            by_label.setdefault(label, []).append(scored(states, body, starts))
        motion = seen(record, beyond=FITS[-1] + 1)
        for label, rival in rivals.items():
            with np.errstate(over="ignore", invalid="ignore"):
                by_label.setdefault(label, []).append(scored(rival(motion, starts, FITS[-1]), plain, starts))
    return by_label


def mean_errors(by_label: dict[str, list[Scored]]) -> str:
    """A table of mean absolute errors, the best of each column in bold."""
    means = {label: np.concatenate([one.errors for one in parts]).mean(axis=0) for label, parts in by_label.items()}
    heads = [f"{group if h == SHOWN[0] else ''} {h / 100:g} s".strip() for group in GROUPS for h in SHOWN]
    rows = np.array([[mean[h - 1, g] for g in range(len(GROUPS)) for h in SHOWN] for mean in means.values()])
    best = rows.min(axis=0)
    cells = [[f"**{v:.3g}**" if v == least else f"{v:.3g}" for v, least in zip(row, best, strict=True)] for row in rows]
    return table(["predictor", *heads], [[label, *row] for label, row in zip(means, cells, strict=True)])


def mean_fits(by_label: dict[str, list[Scored]]) -> str:
    """A table of fit % after the horizons of `FITS`."""
    lines = []
    for label, parts in by_label.items():
        fits = [
            fit_percent(*(np.concatenate(rows) for rows in zip(*(one.fits[h] for one in parts), strict=True)))
            for h in range(len(FITS))
        ]
        cells = [" / ".join(percent(float(np.mean(fit[list(at)]))) for fit in fits) for at in MOTIONS.values()]
        lines.append([label, *cells])
    return table(["predictor", *MOTIONS], lines)


def percent(fit: float) -> str:
    return f"{fit:.0f}" if fit > -1000.0 else "<-999"


def table(heads: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table of Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *lines))


def into_page(text: str, name: str, made: str) -> str:
    """A page with a part of it made anew.

    Raises:
        SystemExit: where it has no such part.
    """
    begin, end = f"<!-- scores: {name} -->", "<!-- end -->"
    before, mark, after = text.partition(begin)
    if not mark or end not in after:
        raise SystemExit(f"the page has no part {begin} ... {end}")
    return f"{before}{begin}\n{made}\n{end}{after.split(end, 1)[1]}"


def main(
    models: dict[str, Vehicle],
    lifted: dict[str, Vehicle],
    fitted: Sequence[str],
    held_out: Sequence[str],
    new: Sequence[str],
    page: Path | None,
) -> None:
    training = [seen(record) for record, _ in of_files(fitted, next(iter(models.values())))] if models else []
    rivals: dict[str, Rival] = {}
    for label, make in RIVALS.items() if models else ():
        began = time.process_time()
        rivals[label] = make(training)
        print(f"{label}: trained in {time.process_time() - began:.0f} s of processor time", flush=True)
    made: dict[str, str] = {}
    for name, flights in (("known kinds", held_out), ("new kinds", new)):
        if flights and models:
            by_label = compare(models, rivals, of_files(flights, next(iter(models.values()))))
            starts = sum(len(one.errors) for one in by_label["hold"])
            made[name] = f"{starts} starts.\n\n{mean_errors(by_label)}"
            made[f"{name}, fit"] = mean_fits(by_label)
    for name, vehicle in lifted.items():
        of = of_files((*held_out, *new), vehicle)
        made[name] = table(HEADS, [along_z(vehicle, record, felt).cells for record, felt in of])
    for name, part in made.items():
        print(f"\n{name}\n{part}")
    if page is not None:
        text = page.read_text()
        for name, part in made.items():
            text = into_page(text, name, part)
        page.write_text(text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", action="append", default=[], metavar="LABEL=MODEL.toml")
    parser.add_argument("--heave", action="append", default=[], metavar="PART=MODEL.toml")
    parser.add_argument("--fit", nargs="+", default=[], metavar="FLIGHT")
    parser.add_argument("--on", nargs="+", required=True, metavar="FLIGHT")
    parser.add_argument("--new", nargs="+", default=[], metavar="FLIGHT")
    parser.add_argument("--page", type=Path, metavar="FILE")
    given = parser.parse_args()
    chosen, told = (
        {m.split("=", 1)[0]: sp.vehicle(m.split("=", 1)[1]) for m in listed} for listed in (given.model, given.heave)
    )
    if bool(chosen) != bool(given.fit) or (not chosen and not told):
        parser.error("give --model with --fit (the rivals are trained on these flights), or --heave, or both.")
    main(chosen, told, given.fit, given.on, given.new, given.page)
