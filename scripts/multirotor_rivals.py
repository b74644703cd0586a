"""Predictors without physics for `multirotor_scores.py`: trained on the flights of the fit, none of them is shipped.

Each learns how body velocities, roll, pitch and body rates follow the motors, and is given what a model is given: the
motion up to a start, commands and voltage up to the target. Motors enter as (command x voltage)^2, which is thrust but
for a factor, less its mean over the seconds that calibrate a model; one of them gets the bare commands instead. Places
and heading are integrals and not learnt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array

Places = NDArray[np.intp]
LEARNT = (3, 4, 5, 6, 7, 9, 10, 11)
"""Columns of u, v, w, phi, theta, p, q, r among the twelve body states."""
_PAST, _SEED = 8, 20


@dataclass(frozen=True)
class Motion:
    """Body states (n, 12), thrusts and bare commands (n, motors) as the module says, and the step [s]."""

    body: Array
    thrusts: Array
    commands: Array
    dt: float

    @property
    def learnt(self) -> Array:
        return self.body[:, LEARNT]


def motion(body: Array, inputs: Array, voltage: Array, dt: float, *, calibration: float) -> Motion:
    """A record as the rivals see it."""
    first = round(calibration / dt)
    thrusts, commands = (inputs * voltage[:, None]) ** 2, inputs
    return Motion(body, thrusts - thrusts[:first].mean(axis=0), commands - commands[:first].mean(axis=0), dt)


Rival = Callable[[Motion, Places, int], Array]
"""From a record, starts (s,) and samples ahead to predicted body states (s, ahead, 12)."""


def _whole(of: Motion, starts: Places, learnt: Array) -> Array:
    """All twelve states from the learnt ones (s, ahead, 8): heading and place by integration."""
    out = np.empty((*learnt.shape[:2], 12))
    out[..., list(LEARNT)] = learnt
    place, heading = of.body[starts, :3], of.body[starts, 8]
    for k in range(learnt.shape[1]):
        heading = heading + of.dt * learnt[:, k, 7]
        attitude = Rotation.from_euler("ZYX", np.stack([heading, learnt[:, k, 4], learnt[:, k, 3]], axis=1))
        place = place + of.dt * attitude.apply(learnt[:, k, :3])
        out[:, k, :3], out[:, k, 8] = place, heading
    return out


def _scales(rows: Array) -> tuple[Array, Array]:
    return rows.mean(axis=0), rows.std(axis=0) + 1e-9


# ---- linear ----------------------------------------------------------------------------------------------------------
def arx(training: Sequence[Motion], *, past: int = _PAST, ridge: float = 1e-3) -> Rival:
    """Autoregression with exogenous inputs (Ljung 1999, sec. 4.2) by least squares on one step, iterated."""

    def row(states: Sequence[Array], thrusts: Sequence[Array]) -> Array:
        return np.concatenate([*states, *thrusts, np.ones((len(states[0]), 1))], axis=1)

    rows, steps = [], []
    for m in training:
        at = np.arange(past, len(m.body) - 1)
        rows.append(row([m.learnt[at - i] for i in range(4)], [m.thrusts[at - i] for i in range(past)]))
        steps.append(m.learnt[at + 1] - m.learnt[at])
    X, y = np.concatenate(rows), np.concatenate(steps)
    size = np.sqrt((X**2).mean(axis=0))
    Xs = X / size
    weights = np.linalg.solve(Xs.T @ Xs + ridge * len(X) * np.eye(X.shape[1]) * 1e-2, Xs.T @ y) / size[:, None]

    def predict(of: Motion, starts: Places, ahead: int) -> Array:
        states = [of.learnt[starts - i] for i in range(4)]
        made = []
        for k in range(ahead):
            states = [states[0] + row(states, [of.thrusts[starts + k - i] for i in range(past)]) @ weights, *states[:3]]
            made.append(states[0])
        return _whole(of, starts, np.stack(made, axis=1))

    return predict


def n4sid(training: Sequence[Motion], *, bare: bool = False) -> Rival:
    """Subspace identification (Van Overschee and De Moor 1994: N4SID) with the filter of its own residuals.

    The oblique projection of later motion on the past, along later inputs, by an LQ decomposition of all flights side
    by side; states from its singular vectors; A, B, C, D by least squares on them, and the filter's gain from what
    these leave. The rows of the Hankel matrices and the order are those whose predictions of the training flights err
    least over half a second.

    Args:
        bare: inputs are the commands, without the static nonlinearity and the voltage.
    """
    size = _scales(np.concatenate([m.learnt for m in training]))[1]

    def error(rival: Rival) -> float:
        total = []
        for m in training:
            starts = np.arange(500, len(m.body) - 51, 25)
            later = m.learnt[starts[:, None] + np.arange(1, 51)]
            total.append((np.abs(rival(m, starts, 50)[..., list(LEARNT)] - later) / size).mean())
        return float(np.mean(total))

    return min((model for rows in (8, 15, 25) for model in _subspace_models(training, bare=bare, rows=rows)), key=error)


def _subspace_models(training: Sequence[Motion], *, bare: bool, rows: int) -> list[Rival]:
    """Models of several orders, from block Hankel matrices of so many rows past and later."""

    def inputs(m: Motion) -> Array:
        return m.commands if bare else m.thrusts

    mean, y_size = _scales(np.concatenate([m.learnt for m in training]))
    u_size = np.concatenate([inputs(m) for m in training]).std(axis=0)
    k_y, k_u = len(LEARNT), len(u_size)

    def hankel(values: Array) -> Array:
        n = len(values) - 2 * rows + 1
        return np.concatenate([values[i : i + n].T for i in range(2 * rows)])

    Y, U = (
        np.concatenate([hankel(each) for each in part], axis=1)
        for part in ([(m.learnt - mean) / y_size for m in training], [inputs(m) / u_size for m in training])
    )
    past = np.concatenate([U[: rows * k_u], Y[: rows * k_y]])
    later_u, later_y = U[rows * k_u :], Y[rows * k_y :]
    lower = np.linalg.qr(np.concatenate([later_u, past, later_y]).T, mode="r").T
    a, b = len(later_u), len(later_u) + len(past)
    along = lower[b:, a:b] @ np.linalg.pinv(lower[a:b, a:b], rcond=1e-8)
    left, size, _ = np.linalg.svd(along @ lower[a:b, :b])  # of the oblique projection, along @ past
    ends = np.cumsum([len(m.learnt) - 2 * rows + 1 for m in training])[:-1] - 1
    inside = np.setdiff1d(np.arange(past.shape[1] - 1), ends)  # a state and the next one of the same flight

    def of_order(order: int) -> Rival:
        X = (left[:, :order].T @ along @ past) / np.sqrt(size[:order, None] * past.shape[1] ** 0.5)
        u, y = later_u[:k_u, inside], later_y[:k_y, inside]
        known = np.concatenate([X[:, inside], u])
        solution = np.linalg.lstsq(known.T, np.concatenate([X[:, inside + 1], y]).T, rcond=None)[0].T
        off = np.concatenate([X[:, inside + 1], y]) - solution @ known
        A, B, C, D = (
            solution[:order, :order],
            solution[:order, order:],
            solution[order:, :order],
            solution[order:, order:],
        )
        spread = off @ off.T / off.shape[1]
        Q, S, R = spread[:order, :order], spread[:order, order:], spread[order:, order:] + 1e-6 * np.eye(k_y)
        P = solve_discrete_are(A.T, C.T, Q, R, s=S)
        gain = np.linalg.solve(C @ P @ C.T + R, (A @ P @ C.T + S).T).T

        def predict(of: Motion, starts: Places, ahead: int) -> Array:
            u, y = inputs(of) / u_size, (of.learnt - mean) / y_size
            x, states = np.zeros(order), np.empty((len(u), order))
            for k in range(int(starts.max()) + 1):
                x = A @ x + B @ u[k] + gain @ (y[k] - C @ x - D @ u[k])
                states[k] = x
            now, made = states[starts], []
            for k in range(1, ahead + 1):
                made.append(now @ C.T + u[starts + k] @ D.T)
                now = now @ A.T + u[starts + k] @ B.T
            return _whole(of, starts, np.stack(made, axis=1) * y_size + mean)

        return predict

    return [of_order(order) for order in (8, 12, 16, 24, 32, 48)]


# ---- accelerations ---------------------------------------------------------------------------------------------------
_LAGS = np.arange(0, _PAST + 1, 2)
"""Samples back of the thrusts that an acceleration depends on."""


def _features(states: Array, thrusts: Sequence[Array]) -> Array:
    return np.concatenate([states, *thrusts], axis=1)


def _accelerations(training: Sequence[Motion]) -> tuple[Array, Array]:
    """Features (n, columns) and the rates of the learnt states (n, 8), all flights together."""
    X, y = [], []
    for m in training:
        at = np.arange(_PAST + 1, len(m.body) - 2)
        X.append(_features(m.learnt[at], [m.thrusts[at - i] for i in _LAGS]))
        y.append((m.learnt[at + 1] - m.learnt[at - 1]) / (2.0 * m.dt))
    return np.concatenate(X), np.concatenate(y)


def _integrated(rates: Callable[[Array], Array]) -> Rival:
    """Euler steps along rates (s, 8) that depend on features."""

    def predict(of: Motion, starts: Places, ahead: int) -> Array:
        states, made = of.learnt[starts], []
        for k in range(ahead):
            states = states + of.dt * rates(_features(states, [of.thrusts[starts + k - i] for i in _LAGS]))
            made.append(states)
        return _whole(of, starts, np.stack(made, axis=1))

    return predict


def boosted_trees(training: Sequence[Motion]) -> Rival:
    """Gradient-boosted trees (Friedman 2001; scikit-learn's by histograms) that give the rates of the learnt states.

    Raises:
        SystemExit: without scikit-learn, which only this table needs.
    """
    try:
        from sklearn.ensemble import HistGradientBoostingRegressor
    except ImportError as error:
        raise SystemExit("gradient-boosted trees need scikit-learn, which is no dependency: install it.") from error
    X, y = _accelerations(training)
    trees = [HistGradientBoostingRegressor(random_state=_SEED).fit(X, rate) for rate in y.T]
    return _integrated(lambda rows: np.stack([tree.predict(rows) for tree in trees], axis=1))


# ---- networks --------------------------------------------------------------------------------------------------------
def _adam(loss: Callable[[Any, Any], Any], weights: Any, batches: Callable[[int], Any], *, steps: int) -> Any:
    import optax

    rule = optax.adam(optax.cosine_decay_schedule(3e-3, steps))

    @jax.jit
    def step(weights: Any, state: Any, batch: Any) -> Any:
        update, state = rule.update(jax.grad(loss)(weights, batch), state)
        return optax.apply_updates(weights, update), state

    state = rule.init(weights)
    for i in range(steps):
        weights, state = step(weights, state, batches(i))
    return weights


def _layers(rng: np.random.Generator, sizes: Sequence[int]) -> list[tuple[Any, Any]]:
    return [(jnp.asarray(rng.normal(size=(a, b)) / np.sqrt(a)), jnp.zeros(b)) for a, b in pairwise(sizes)]


def _network(layers: Any, x: Any) -> Any:
    for w, b in layers[:-1]:
        x = jnp.tanh(x @ w + b)
    w, b = layers[-1]
    return x @ w + b


def perceptron(training: Sequence[Motion], *, steps: int = 4000) -> Rival:
    """Two layers of 32 that give the rates of the learnt states from them and the thrusts of the last 0.08 s."""
    rng = np.random.default_rng(_SEED)
    x, rates = _accelerations(training)
    (x_mean, x_size), (y_mean, y_size) = _scales(x), _scales(rates)
    xs, ys = jnp.asarray((x - x_mean) / x_size), jnp.asarray((rates - y_mean) / y_size)

    def loss(layers: Any, at: Any) -> Any:
        weight = sum(jnp.sum(w**2) for w, _ in layers)
        return jnp.mean((_network(layers, xs[at]) - ys[at]) ** 2) + 1e-4 * weight

    layers = _adam(loss, _layers(rng, (x.shape[1], 32, 32, 8)), lambda _: rng.integers(0, len(x), 256), steps=steps)
    told = jax.jit(_network)
    return _integrated(lambda rows: np.asarray(told(layers, (rows - x_mean) / x_size)) * y_size + y_mean)


def lstm(training: Sequence[Motion], *, hidden: int = 32, warm: int = 30, ahead: int = 50, steps: int = 1500) -> Rival:
    """A long short-term memory (Hochreiter and Schmidhuber 1997): it sees 0.3 s of motion, then answers with its own.

    Trained on predictions over the whole horizon, every state by its spread.
    """
    rng = np.random.default_rng(_SEED)
    mean, size = _scales(np.concatenate([m.learnt for m in training]))
    u_size = np.concatenate([m.thrusts for m in training]).std(axis=0) + 1e-9
    moved = np.concatenate([m.learnt[10:] - m.learnt[:-10] for m in training]).std(axis=0) / size
    n_x, n_u = len(LEARNT), training[0].thrusts.shape[1]

    def cell(weights: Any, memory: Any, x: Any, u: Any) -> Any:
        (w, b), (out, c) = weights
        h, s = memory
        i, f, o, g = jnp.split(jnp.concatenate([x, u, h], axis=-1) @ w + b, 4, axis=-1)
        s = jax.nn.sigmoid(f + 1.0) * s + jax.nn.sigmoid(i) * jnp.tanh(g)
        h = jax.nn.sigmoid(o) * jnp.tanh(s)
        return (h, s), x + 0.1 * (h @ out + c)

    def run(weights: Any, seen: Any, thrusts: Any) -> Any:
        """Predictions (ahead, s, 8) from motion (warm + 1, s, 8) and thrusts (warm + ahead, s, motors)."""
        still = (jnp.zeros((seen.shape[1], hidden)),) * 2

        def watch(memory: Any, now: Any) -> Any:
            memory, _ = cell(weights, memory, *now)
            return memory, None

        def answer(carry: Any, u: Any) -> Any:
            memory, x = cell(weights, *carry, u)
            return (memory, x), x

        memory, _ = jax.lax.scan(watch, still, (seen[:-1], thrusts[:warm]))
        return jax.lax.scan(answer, (memory, seen[-1]), thrusts[warm:])[1]

    def windows(of: Motion, starts: Places, length: int) -> tuple[Array, Array]:
        before, after = np.arange(-warm, 1)[:, None] + starts, np.arange(-warm, length)[:, None] + starts
        return (of.learnt[before] - mean) / size, of.thrusts[after] / u_size

    def batches(_: int) -> Any:
        parts = []
        for m in training:
            starts = rng.integers(warm, len(m.body) - ahead - 1, 16)
            later = (m.learnt[np.arange(1, ahead + 1)[:, None] + starts] - mean) / size
            parts.append((*windows(m, starts, ahead), later))
        return tuple(jnp.asarray(np.concatenate(rows, axis=1)) for rows in zip(*parts, strict=True))

    def loss(weights: Any, batch: Any) -> Any:
        seen, thrusts, later = batch
        return jnp.mean(jnp.abs(run(weights, seen, thrusts) - later) / moved) + 1e-5 * sum(
            jnp.sum(w**2) for w, _ in weights
        )

    begin = [*_layers(rng, (n_x + n_u + hidden, 4 * hidden)), *_layers(rng, (hidden, n_x))]
    weights = _adam(loss, begin, batches, steps=steps)
    told = jax.jit(run)

    def predict(of: Motion, starts: Places, length: int) -> Array:
        made = np.asarray(told(weights, *windows(of, starts, length))) * size + mean
        return _whole(of, starts, np.moveaxis(made, 0, 1))

    return predict


RIVALS: dict[str, Callable[[Sequence[Motion]], Rival]] = {
    "linear ARX": arx,
    "N4SID, commands alone": partial(n4sid, bare=True),
    "N4SID, thrusts": n4sid,
    "gradient-boosted trees on accelerations": boosted_trees,
    "small network on accelerations": perceptron,
    "LSTM": lstm,
}
