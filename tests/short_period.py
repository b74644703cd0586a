"""A short period of an aircraft in gusts, flown without discretisation error: what estimators fly."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

A, B = np.array([[-1.0, 3.0], [-4.0, -2.0]]), np.array([-2.0, -10.0])
TRUTH = {"Mw": -4.0, "Mq": -2.0, "Md": -10.0}


def short_period(n: int, *, gust: float = 0.0, dt: float = 0.01, seed: int = 0) -> np.ndarray:
    """q, w and the elevator, which is held between samples, without discretisation error."""
    random = np.random.default_rng(seed)
    step = expm(np.block([[A, B[:, None]], [np.zeros((1, 3))]]) * dt)
    time, state, rows = np.arange(n) * dt, np.zeros(2), []
    for t in time:
        elevator = sum(0.1 * np.sin(2.0 * np.pi * f * t + 7.0 * f * f) for f in np.arange(0.2, 2.01, 0.2))
        rows.append([state[1], state[0], elevator])
        state = step[:2, :2] @ state + step[:2, 2] * elevator
        state = state + gust * np.sqrt(dt) * random.standard_normal(2)
    return np.array(rows)
