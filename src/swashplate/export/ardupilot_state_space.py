"""A linear hover model as the flat JSON that a state-space helicopter proposed for ArduPilot's SITL reads, and back.

Its equations have fewer terms than ours: `ardupilot_state_space` reduces a model to them, and says what it left out and
how far the on-axis rate responses moved. Signs there: sticks positive to the right, nose up and nose right, collective
up; a1s tilts back, b1s to the right.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from swashplate import documents
from swashplate.arrays import Complex
from swashplate.errors import ExportError
from swashplate.export.linear import Linear

KEYS = (
    "Ma1s", "Lb1s", "Xa1s", "Yb1s", "Mu", "Mv", "Mq", "Mp", "Lu",
    "Lv", "Lp", "Lq", "Lr", "Xu", "Yv", "Yr", "Yp", "Zw",
    "Nr", "Nw", "Nv", "Ncol", "Mlon", "Mlat", "Llon", "Llat", "Nped",
    "Xlon", "Ylat", "Zcol", "time_delay_rp", "time_delay_ped", "time_delay_col", "Lag", "Lead", "tf",
    "Lfa1s", "Mfb1s", "Lflt", "Lflg", "Mflt", "Mflg", "hover_lean", "nominal_rpm", "coll_max",
    "coll_min", "coll_hover", "thr_hover",
)  # fmt: skip

_BODY = ("u", "v", "w", "p", "q", "r", "phi", "theta")
_SLOW = ("x", "y", "z", "psi", "omega", "governor")
"""States that the format knows nothing of and that are held: place, heading, rotor speed."""
_TILTS = (("b1", "a1"), ("b1s", "a1s"), ("b", "a"), ("d", "c"))
"""Tilt to the right and back of a tip-path plane, the rotor's or a stabilizer bar's: one pair fits into the format."""
STICKS = ("roll", "pitch", "yaw", "collective")
_STICK_NAMES = {
    "roll": ("mixer_roll", "lateral", "A1"),
    "pitch": ("mixer_pitch", "longitudinal", "B1"),
    "yaw": ("mixer_yaw", "pedal", "theta0T"),
    "collective": ("mixer_collective", "collective", "theta0"),
}
_FORCES = {
    "p": {"u": "Lu", "v": "Lv", "p": "Lp", "q": "Lq", "r": "Lr", "roll": "Llat", "pitch": "Llon"},
    "q": {"u": "Mu", "v": "Mv", "p": "Mp", "q": "Mq", "roll": "Mlat", "pitch": "Mlon"},
    "r": {"v": "Nv", "w": "Nw", "r": "Nr", "yaw": "Nped", "collective": "Ncol"},
    "u": {"u": "Xu", "pitch": "Xlon"},
    "v": {"v": "Yv", "p": "Yp", "r": "Yr", "roll": "Ylat"},
    "w": {"w": "Zw", "collective": "Zcol"},
}
"""Which derivative of a row stands under which key."""
_BY_DISC = {("p", "b"): "Lb1s", ("q", "a"): "Ma1s", ("u", "a"): "Xa1s", ("v", "b"): "Yb1s"}
_ANOTHER = 0.3
"""Share of a response's peak beyond which a reduced model is not the one that was asked for."""
_SEEN = np.geomspace(1.0, 20.0, 40)  # rad/s, where a pilot and an autopilot close their loops


@dataclass(frozen=True)
class Sticks:
    """What is known of the controls beyond a linear model.

    Attributes:
        reach: what the full stick moves an input by, by input name; 1 where it is not said.
        lean: roll angle of the hover [rad]. speed: rotor speed [rad/s], None where it is not known.
        collective: its limits and hover value in one unit, None where they are not known.
    """

    reach: Mapping[str, float]
    lean: float = 0.0
    speed: float | None = None
    collective: tuple[float, float, float] | None = None


def ardupilot_state_space(model: Linear, sticks: Sticks) -> tuple[dict[str, float], tuple[str, ...]]:
    """The numbers by key, and what a user must know.

    Raises:
        ExportError: for a model without the sticks or states of a single-rotor helicopter in hover.
    """
    plain = _in_sticks(model, sticks)
    pairs = [pair for pair in _TILTS if set(pair) <= set(plain.states)]
    tried = [_reduced(plain, pair) for pair in pairs] or [_reduced(plain, None)]
    numbers = min(tried, key=lambda entries: max(_moved(plain, assembled(entries)).values()))
    for key, names in {"rp": ("roll", "pitch"), "ped": ("yaw",), "col": ("collective",)}.items():
        late = [plain.delay(plain.outputs[0], name) for name in names if name in plain.inputs]
        if any(late):
            numbers[f"time_delay_{key}"] = 1e3 * float(np.mean(late))
    if sticks.lean:
        numbers["hover_lean"] = math.degrees(sticks.lean)
    if sticks.speed is not None:
        numbers["nominal_rpm"] = sticks.speed * 60.0 / (2.0 * math.pi)
    notes = []
    if sticks.collective is not None:
        low, high, hover = sticks.collective
        numbers |= {"coll_min": math.degrees(low), "coll_max": math.degrees(high), "coll_hover": math.degrees(hover)}
    else:
        missing = "coll_min, coll_max, coll_hover and nominal_rpm"
        notes.append(f"The model knows neither collective limits nor rotor speed: add {missing}.")
    moved = _moved(plain, assembled(numbers))
    told = ", ".join(f"{axis} {share:.1%}" for axis, share in moved.items())
    notes.append(f"On-axis rate responses from 1 to 20 rad/s moved by at most, of their peaks: {told}.")
    if max(moved.values()) > _ANOTHER:
        notes.append("That is another aircraft: this format has no room for the model's bar, gyro or inflow.")
    return dict(sorted(numbers.items(), key=lambda item: KEYS.index(item[0]))), tuple(notes)


def _reduced(plain: Linear, kept: tuple[str, str] | None) -> dict[str, float]:
    """The numbers that are not 0, with one pair of tilts kept as states and the others settled."""
    held = _without(plain, [s for s in plain.states if s in _SLOW], steady=False)
    fast = [s for s in held.states if s not in _BODY and (kept is None or s not in kept)]
    settled = _without(held, fast, steady=True)
    entries = _with_tilts(settled, kept) if kept else _quasi_steady(settled)
    return {key: float(value) for key, value in entries.items() if value}


def to_json(numbers: Mapping[str, float]) -> str:
    """The text of the file."""
    return json.dumps(dict(numbers), indent=1, allow_nan=False) + "\n"


def read_ardupilot(path: str | Path) -> dict[str, float]:
    """The numbers of a file; those that it does not give are 0.

    Raises:
        ExportError: naming the entry that is unknown or no number.
    """
    document = documents.read_document(path, form="json", error=ExportError)
    for key, value in document.items():
        if key not in KEYS:
            raise ExportError("is no number of ArduPilot's state-space helicopter.", where=path, channel=key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ExportError(f"is {value!r}, expected a number.", where=path, channel=key)
    return {key: float(document.get(key, 0.0)) for key in KEYS}


def assembled(numbers: Mapping[str, float]) -> Linear:
    """The linear model about hover that the format's equations make of the numbers; outputs are the states."""
    rotor = bool(numbers.get("tf", 0.0))
    states = (*_BODY, "b", "a") if rotor else _BODY
    A, B = np.zeros((len(states), len(states))), np.zeros((len(states), 4))
    where = {name: i for i, name in enumerate(states)}
    for row, keys in _FORCES.items():
        for name, key in keys.items():
            value = numbers.get(key, 0.0)
            if name in STICKS:
                B[where[row], STICKS.index(name)] = value
            else:
                A[where[row], where[name]] = value
    A[where["phi"], where["p"]] = A[where["theta"], where["q"]] = 1.0
    A[where["u"], where["theta"]], A[where["v"], where["phi"]] = -9.80665, 9.80665
    if rotor:
        tf, b, a = numbers["tf"], where["b"], where["a"]
        for (row, tilt), key in _BY_DISC.items():
            A[where[row], where[tilt]] = numbers.get(key, 0.0)
        A[b, where["p"]] = A[a, where["q"]] = -1.0
        A[b, b] = A[a, a] = -1.0 / tf
        A[b, a], A[a, b] = numbers.get("Lfa1s", 0.0) / tf, numbers.get("Mfb1s", 0.0) / tf
        B[b, :2] = numbers.get("Lflt", 0.0) / tf, numbers.get("Lflg", 0.0) / tf
        B[a, :2] = numbers.get("Mflt", 0.0) / tf, numbers.get("Mflg", 0.0) / tf
    delays = dict(
        zip(STICKS, (numbers.get(f"time_delay_{k}", 0.0) / 1e3 for k in ("rp", "rp", "ped", "col")), strict=True)
    )
    n = len(states)
    return Linear("ardupilot", "", "", A, B, np.eye(n), np.zeros((n, 4)), states, STICKS, states, {}, delays)


def _in_sticks(model: Linear, sticks: Sticks) -> Linear:
    """The model with roll, pitch, yaw and collective sticks as inputs, oriented as the format has them; y = x."""
    chosen = {stick: next((n for n in names if n in model.inputs), None) for stick, names in _STICK_NAMES.items()}
    if chosen["roll"] is None or chosen["pitch"] is None or not {"p", "q"} <= set(model.states):
        raise ExportError(
            f"has the inputs {', '.join(model.inputs)}: the format is for single-rotor helicopters with cyclic.",
            where=model.name,
            channel="ardupilot-statespace",
            hint="Use --format c, or fly it under ArduPilot with `swash link ardupilot`.",
        )
    columns, delays, used = [], {}, []
    answers = {"roll": ("p", 1.0), "pitch": ("q", 1.0), "yaw": ("r", 1.0), "collective": ("w", -1.0)}
    for stick, name in chosen.items():
        state, sign = answers[stick]
        if name is None or state not in model.states:
            continue
        effect = _early(model, state, name)
        turned = sign if effect >= 0.0 else -sign
        columns.append(turned * sticks.reach.get(name, 1.0) * model.B[:, model.inputs.index(name)])
        delays[stick] = model.delay(state if state in model.outputs else model.outputs[0], name)
        used.append(stick)
    n = len(model.states)
    return replace(
        model,
        B=np.stack(columns, axis=1),
        C=np.eye(n),
        D=np.zeros((n, len(used))),
        inputs=tuple(used),
        outputs=model.states,
        delays=delays,
    )


def _early(model: Linear, state: str, name: str) -> float:
    """What a held input has done to a state after a quarter of a second: its sense, the rotor's lag included."""
    from swashplate.simulation.discretisation import zero_order_hold

    _, G = zero_order_hold(model.A, model.B, 0.25)
    return float(G[model.states.index(state), model.inputs.index(name)])


def _without(model: Linear, names: list[str], *, steady: bool) -> Linear:
    """Without some states: held at zero, or following without delay (their rates zero)."""
    out = [model.states.index(name) for name in names]
    keep = [i for i in range(len(model.states)) if i not in out]
    A, B = model.A[np.ix_(keep, keep)], model.B[keep]
    if steady and out:
        inner, coupling = model.A[np.ix_(out, out)], model.A[np.ix_(keep, out)]
        A = A - coupling @ np.linalg.solve(inner, model.A[np.ix_(out, keep)])
        B = B - coupling @ np.linalg.solve(inner, model.B[out])
    states = tuple(model.states[i] for i in keep)
    n = len(keep)
    return replace(model, A=A, B=B, C=np.eye(n), D=np.zeros((n, B.shape[1])), states=states, outputs=states)


def _entry(model: Linear, row: str, name: str) -> float:
    if row not in model.states:
        return 0.0
    i = model.states.index(row)
    if name in model.inputs:
        return float(model.B[i, model.inputs.index(name)])
    return float(model.A[i, model.states.index(name)]) if name in model.states else 0.0


def _quasi_steady(model: Linear) -> dict[str, float]:
    return {key: _entry(model, row, name) for row, keys in _FORCES.items() for name, key in keys.items()}


def _with_tilts(model: Linear, kept: tuple[str, str]) -> dict[str, float]:
    """With `kept` as b1s and a1s; what the format's flapping equations lack enters the body's rows as it settles to."""
    names = dict(zip(("b", "a"), kept, strict=True))
    place = [model.states.index(names[tilt]) for tilt in ("b", "a")]
    inner = model.A[np.ix_(place, place)]
    tf = -2.0 / float(np.trace(inner))
    if not tf > 0.0:
        raise ExportError("the tip-path plane does not come to rest by itself.", where=model.name)
    lacking = model.A[place].copy(), model.B[place].copy()
    lacking[0][:, place] = 0.0
    for k, rate in enumerate(("p", "q")):
        lacking[0][k, model.states.index(rate)] += 1.0
    for stick in ("roll", "pitch"):
        lacking[1][:, model.inputs.index(stick)] = 0.0
    settled = [-np.linalg.solve(inner, part) for part in lacking]
    rest = [i for i in range(len(model.states)) if i not in place]
    A, B = model.A.copy(), model.B.copy()
    A[rest] += model.A[np.ix_(rest, place)] @ settled[0]
    B[rest] += model.A[np.ix_(rest, place)] @ settled[1]
    body = replace(model, A=A, B=B)
    entries = _quasi_steady(body)
    entries |= {key: _entry(model, row, names[tilt]) for (row, tilt), key in _BY_DISC.items()}
    entries |= {"tf": tf, "Lfa1s": tf * float(inner[0, 1]), "Mfb1s": tf * float(inner[1, 0])}
    for k, (roll, pitch) in enumerate((("Lflt", "Lflg"), ("Mflt", "Mflg"))):
        entries[roll] = tf * float(model.B[place[k], model.inputs.index("roll")])
        entries[pitch] = tf * float(model.B[place[k], model.inputs.index("pitch")])
    return entries


def _moved(one: Linear, other: Linear) -> dict[str, float]:
    """Largest difference of the on-axis rate responses by stick, as a share of the response's peak."""
    by_stick = {}
    for stick, rate in {"roll": "p", "pitch": "q", "yaw": "r"}.items():
        if stick in one.inputs and rate in one.states:
            before, after = (_response(model, rate, stick) for model in (one, other))
            by_stick[stick] = float(np.max(np.abs(after - before)) / np.max(np.abs(before)))
    return by_stick


def _response(model: Linear, output: str, stick: str) -> Complex:
    s = 1j * _SEEN[:, None, None]
    column = np.broadcast_to(model.B[:, [model.inputs.index(stick)]] + 0j, (_SEEN.size, len(model.states), 1))
    x = np.linalg.solve(s * np.eye(len(model.states)) - model.A, column)
    return np.asarray(x[:, model.states.index(output), 0], dtype=np.complex128)
