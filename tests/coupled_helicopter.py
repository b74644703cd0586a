"""A helicopter of 60 kg in hover with numbers of its own: body, coupled tip-path plane, inflow and engine, as matrices.

Written from the equations of motion and the rotor's size, without any structure of the package: twelve states, of which
the tip-path plane, the induced velocity and the engine's torque are hidden.
"""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.responses.frequency_response import FrequencyResponse

STATES = ("u", "v", "w", "p", "q", "r", "phi", "theta", "a", "b", "nu", "torque")
INPUTS = ("lateral", "longitudinal", "pedal", "collective")
OUTPUTS = ("u", "v", "w", "p", "q", "r", "ax", "ay", "az")
DELAYS = {"lateral": 0.025, "longitudinal": 0.035, "pedal": 0.015, "collective": 0.03}

GRAVITY, DENSITY, MASS, RADIUS = 9.80665, 1.225, 60.0, 1.6
TIP_SPEED, BLADES_AREA, LIFT_SLOPE = 130.0, 0.32, 5.5
DISC = np.pi * RADIUS**2
INDUCED = float(np.sqrt(MASS * GRAVITY / (2.0 * DENSITY * DISC)))
"""Induced velocity in hover [m/s]."""
AIR = 8.0 / 3.0 * DENSITY * RADIUS**3
"""Mass of the air that moves with the disc [kg] (Pitt and Peters 1981)."""
THRUST_BY_W = DENSITY * TIP_SPEED * BLADES_AREA * LIFT_SLOPE / 4.0
"""Thrust by vertical speed with the inflow frozen [N s/m]."""
THRUST_BY_COLLECTIVE = 26.0 * MASS
ROLL, PITCH, LAG = 210.0, 95.0, 0.075
"""Hub moments by tilt [1/s^2], time constant of the tip-path plane [s]."""


def matrices(*, inflow: bool = True, engine: bool = True, crossed: float = 0.0) -> tuple[Array, Array]:
    """A and B; without inflow the induced velocity stands still, without engine all torque acts at once.

    Args:
        inflow, engine: whether they are there. crossed: product of inertia that couples roll with yaw, by moment.
    """
    at = {name: k for k, name in enumerate(STATES)}
    at_input = {name: k for k, name in enumerate(INPUTS)}
    a, b = np.zeros((12, 12)), np.zeros((12, 4))

    def row(state: str, **terms: float) -> None:
        for name, value in terms.items():
            if name in at:
                a[at[state], at[name]] = value
            else:
                b[at[state], at_input[name]] = value

    row("u", u=-0.03, theta=-GRAVITY, a=-GRAVITY)
    row("v", v=-0.11, phi=GRAVITY, b=GRAVITY, pedal=2.2)
    row("p", u=-0.15, v=-0.28, b=ROLL, pedal=-3.0)
    row("q", u=0.12, v=-0.09, a=PITCH, collective=4.0)
    row("r", v=0.35, w=0.15, r=-1.1, pedal=38.0, torque=1.0)
    row("phi", p=1.0)
    row("theta", q=1.0)
    # Tip-path plane: (1 + LAG s) a = -LAG q + coupling + cyclic, to the rear; b to the right.
    row("a", q=-1.0, a=-1.0 / LAG, b=-0.30 / LAG, longitudinal=-0.21 / LAG, lateral=0.035 / LAG)
    row("b", p=-1.0, b=-1.0 / LAG, a=0.42 / LAG, lateral=0.24 / LAG, longitudinal=0.03 / LAG)
    # Thrust answers to w - nu; the air that moves with the disc answers to thrust and to the flow through it.
    damping, flow = THRUST_BY_W / MASS, 2.0 * DENSITY * DISC * INDUCED
    row("w", w=-damping, nu=damping, collective=-THRUST_BY_COLLECTIVE / MASS)
    if inflow:
        row("nu", nu=-(2.0 * flow + THRUST_BY_W) / AIR, w=(flow + THRUST_BY_W) / AIR)
        row("nu", collective=THRUST_BY_COLLECTIVE / AIR)
    else:
        row("nu", nu=-1.0)
    if engine:
        row("torque", torque=-2.6, collective=2.6 * 22.0)
    else:
        row("torque", torque=-1.0)
        row("r", collective=22.0)
    if crossed:
        a[at["r"]] += crossed * a[at["p"]]
        b[at["r"]] += crossed * b[at["p"]]
    return a, b


def response(a: Array, b: Array, omega: Array) -> Complex:
    """Of speeds, rates and accelerometers at the centre of gravity, with the delays; (n_f, 9, 4)."""
    at = {name: k for k, name in enumerate(STATES)}
    x = np.linalg.solve(1j * omega[:, None, None] * np.eye(12) - a, np.broadcast_to(b + 0j, (omega.size, *b.shape)))
    rate = 1j * omega[:, None, None] * x
    seen = [x[:, at[name]] for name in OUTPUTS[:6]]
    seen.append(rate[:, at["u"]] + GRAVITY * x[:, at["theta"]])
    seen.append(rate[:, at["v"]] - GRAVITY * x[:, at["phi"]])
    seen.append(rate[:, at["w"]])
    late = np.array([DELAYS[name] for name in INPUTS])
    return np.stack(seen, axis=1) * np.exp(-1j * omega[:, None, None] * late)


def measured(
    a: Array,
    b: Array,
    *,
    seed: int = 1,
    noise: float = 0.03,
    averages: float = 12.0,
    outputs: tuple[str, ...] = OUTPUTS,
) -> FrequencyResponse:
    """Responses from 0.08 to 6 Hz as `respond` would estimate them from sweeps with noisy sensors.

    Args:
        a, b: of the helicopter.
        seed: of the errors.
        noise: power of each sensor's noise over that of its best-swept response, at all frequencies.
        averages: independent windows behind each line.
        outputs: those that were logged.
    """
    omega = 2.0 * np.pi * np.geomspace(0.08, 6.0, 70)
    h = response(a, b, omega)[:, [OUTPUTS.index(name) for name in outputs]]
    floor = noise**2 * np.median(np.max(np.abs(h), axis=2), axis=0)[None, :, None] ** 2
    coherence = np.abs(h) ** 2 / (np.abs(h) ** 2 + floor)
    error = np.sqrt((1.0 - coherence) / (2.0 * averages * np.maximum(coherence, 1e-12))) + 0.005
    random = np.random.default_rng(seed)
    h = h * (1.0 + error * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    n_f, n_out, n_in = h.shape
    return FrequencyResponse(
        omega=omega, inputs=INPUTS, outputs=outputs, response=h, coherence=coherence,
        multiple=coherence.max(axis=2), error=error, input_power=np.ones((n_f, n_in)),
        output_power=np.ones((n_f, n_out)), input_coherence=np.broadcast_to(np.eye(n_in), (n_f, n_in, n_in)).copy(),
    )  # fmt: skip
