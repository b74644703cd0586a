"""Linear models about a trim, by automatic differentiation, with named states and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eig, schur, solve_sylvester

from swashplate import atomic
from swashplate.arrays import Array, Complex, largest_first
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.engine.slopes import rates_and_slopes
from swashplate.models.linear import python_control
from swashplate.models.linear.matrices_file import state_space_of_matrices
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import to_toml
from swashplate.models.residual import refuse_predictor
from swashplate.models.surroundings import known_delays
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Shown
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim import trim as find_trim


@dataclass(frozen=True)
class Mode:
    """One real eigenvalue or one conjugate pair.

    Attributes:
        eigenvalue: with the positive imaginary part [1/s].
        frequency: its modulus, the natural frequency [rad/s].
        damping: damping ratio; 1 for a stable real mode, -1 for an unstable one, 0 at the origin.
        time_constant: -1 / real part [s]; negative where the mode grows, infinite where it does neither.
        states: the three states that take part most, and those that do so as much as the third, largest first and
            equal ones in the model's order, with their share (participation factors). At the origin, whose
            eigenvalues often repeat: all states of that subspace, in the model's order.
    """

    eigenvalue: complex
    frequency: float
    damping: float
    time_constant: float
    states: tuple[tuple[str, float], ...]


_ORIGIN = 1e-6
"""1/s; chains of integrators leave eigenvalues of rounding's root about the origin, which are no modes."""

_TAKES_PART = 0.1
"""Share from which a state is named with the eigenvalues at the origin."""


@dataclass(frozen=True)
class LinearModel(Shown):
    """dx/dt = A x + B u, y = C x + D u, for deviations from a trim.

    Attributes:
        A, B, C, D: matrices; the outputs are the states.
        G: effect of wind (north, east, down) and voltage, columns in that order.
        states, inputs, disturbances: names of the columns.
        trim: what the deviations are counted from.
        delays: identified ones of the inputs [s], which the matrices have not; empty where none is known.
        units: of states and inputs.
        limits: lower and upper of the inputs.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    G: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    trim: Trim
    delays: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def modes(self) -> tuple[Mode, ...]:
        """Eigenvalues with damping and frequency, fastest first."""
        # The chains of integrators of a hovering vehicle make the eigenvectors singular: left ones not by inversion.
        values, left, right = eig(self.A, left=True)
        share = np.abs(right * left.conj())
        share /= np.maximum(share.sum(axis=0), np.finfo(float).tiny)
        integrating = _integrating(self.A, self.states)
        modes = []
        for i in np.argsort(-np.abs(values), kind="stable"):
            if abs(values[i]) <= _ORIGIN:
                modes.append(Mode(0j, 0.0, 0.0, np.inf, integrating))
                continue
            value = complex(values[i])
            if value.imag < 0.0:
                continue
            order = largest_first(share[:, i])
            # Three, and what takes part as much as the third.
            enough = max(_TAKES_PART, (1.0 - 1e-6) * share[order[:3][-1], i])
            order = order[: max(3, int(np.count_nonzero(share[:, i] >= enough)))]
            frequency = abs(value)
            modes.append(
                Mode(
                    value,
                    frequency,
                    -value.real / frequency,
                    -1.0 / value.real if value.real != 0.0 else np.inf,
                    tuple((self.states[j], float(share[j, i])) for j in order),
                )
            )
        return tuple(modes)

    @property
    def outputs(self) -> tuple[str, ...]:
        """The states."""
        return self.states

    def eigenvalues(self) -> Complex:
        """Of A [1/s], fastest first; `modes` says what they are."""
        values = np.linalg.eigvals(self.A).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]

    def response(self, omega: Array) -> Complex:
        """H(j omega) at frequencies [rad/s] with the identified delays, shape (n, n_states, n_inputs)."""
        s: Complex = np.asarray(1j * np.asarray(omega)[:, None, None], dtype=np.complex128)
        x = np.linalg.solve(s * np.eye(len(self.states)) - self.A, self.B[None] + 0j)
        delays = [[self.delays.get(f"{o}/{i}", self.delays.get(i, 0.0)) for i in self.inputs] for o in self.outputs]
        return np.asarray((self.C @ x + self.D) * np.exp(-s * np.array(delays)), dtype=np.complex128)

    def to_control(self, *, pade: int | None = None) -> Any:
        """The model as a `control.StateSpace` of python-control with named signals.

        Args:
            pade: order of the polynomials that stand for the inputs' identified delays; 0 leaves the delays out, None
                does so with a warning where there are any.

        Raises:
            SwashError: an order outside 0 to 12.
        """
        return python_control.state_space(
            (self.A, self.B, self.C, self.D),
            states=self.states,
            inputs=self.inputs,
            outputs=self.states,
            delays=self.delays,
            pade=pade,
            name="the linear model",
        )

    def to_structure(self, *, name: str = "", title: str = "") -> StateSpaceModel:
        """The model as one of named numbers with its [trim] and [limits], which a file can hold (`save`).

        Place and heading are left out where nothing depends on them; kinematics give them.

        Args:
            name: of the model; "" for one made of the speed.
            title: the same for people.

        Raises:
            CardError: where an input is trimmed at its limit or beyond, so that no range about it is left.
        """
        return state_space_of_matrices(
            (self.A, self.B),
            states=self.states,
            inputs=self.inputs,
            units=self.units,
            trim=self.trim.states() | self.trim.commands() | {"air_density": float(self.trim.environment.air_density)},
            limits=self.limits,
            delays=self.delays,
            name=name or f"at_{self.trim.speed:g}",
            title=title or f"Linearised at {self.trim.speed:g} m/s",
        )

    def save(self, path: str | Path) -> Path:
        """Write the model's file, which `swashplate.vehicle` and `swashplate.stitch` read."""
        return atomic.write_text(path, to_toml(self.to_structure(name=Path(path).stem)))

    def __repr__(self) -> str:
        lines = [f"LinearModel: {len(self.states)} states, inputs {', '.join(self.inputs)}"]
        lines.append(f"  {'eigenvalue [1/s]':<22}{'frequency [rad/s]':>18}{'damping':>9}  states")
        modes = self.modes()
        moving = [mode for mode in modes if mode.frequency > 0.0]
        still = modes[len(moving) :]
        for mode in (*moving, *still[:1]):
            value = mode.eigenvalue
            text = f"{value.real:+.3f}" + (f" +/- {value.imag:.3f}j" if value.imag > 0.0 else "")
            if mode.frequency == 0.0:
                text = "0" + (f" ({len(still)} times)" if len(still) > 1 else "")
            taking_part = ", ".join(name for name, share in mode.states if share > 0.1)
            lines.append(f"  {text:<22}{mode.frequency:>18.3f}{mode.damping:>9.3f}  {taking_part}")
        return "\n".join(lines)


def _integrating(A: Array, states: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """States in the eigenvalues at the origin, in their order, with the share of each that lies in that subspace.

    Single eigenvectors of a repeated eigenvalue are of no meaning: rounding chooses them. The spectral projector on all
    of them (Golub and Van Loan 2013, sec. 7.6.3) is unique.
    """
    T, Z, n = schur(A, output="complex", sort=lambda value: abs(value) <= _ORIGIN)
    if n == 0:
        return ()
    coupling = solve_sylvester(T[:n, :n], -T[n:, n:], -T[:n, n:])
    projector = Z[:, :n] @ np.hstack([np.eye(n), -coupling]) @ Z.conj().T
    share = np.abs(np.diag(projector))
    return tuple((name, float(value)) for name, value in zip(states, share, strict=True) if value > _TAKES_PART)


def linearize(vehicle: Vehicle, trim: Trim | None = None) -> LinearModel:
    """The linear model of a vehicle about a trim (hover where none is given), by exact forward differentiation.

    Quadratic terms such as u |u| have no slope at hover; about a trim in forward flight they have.

    Raises:
        CardError: for a model whose residual is for predictions only.
        TrimError: where no trim is given and it has no hover.
    """
    refuse_predictor(vehicle, "linear models and controllers")
    about = trim if trim is not None else find_trim(vehicle)
    surroundings = [getattr(about.environment, name) for name in SURROUNDINGS]
    w = np.array([*about.inputs, *surroundings], dtype=np.float64)
    _, A, W = rates_and_slopes(equations_of(vehicle), about.state, w, parameter_row(vehicle, about.environment))
    n, m = len(vehicle.state_names), len(vehicle.input_names)
    return LinearModel(
        A=np.asarray(A),
        B=np.asarray(W)[:, :m],
        C=np.eye(n),
        D=np.zeros((n, m)),
        G=np.asarray(W)[:, m:],
        states=vehicle.state_names,
        inputs=vehicle.input_names,
        disturbances=SURROUNDINGS,
        trim=about,
        delays=known_delays(vehicle),
        units=dict(
            zip((*vehicle.state_names, *vehicle.input_names), (*vehicle.state_units, *vehicle.input_units), strict=True)
        ),
        limits=dict(zip(vehicle.input_names, vehicle.input_limits, strict=True)),
    )
