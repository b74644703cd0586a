"""One response from windows of several lengths: each frequency from those that tell most about it."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array, Complex

_ITERATIONS = 12


def composite(input_power: Array, output_power: Array, cross: Complex, error: Array) -> tuple[Array, Array, Complex]:
    """The spectra that agree best with those of all windows (Tischler and Remple 2012, eqs 10.14 to 10.17).

    Minimises sum W_i { ((Gxx - Gxx_i)/Gxx_i)^2 + ((Gyy - Gyy_i)/Gyy_i)^2 + (|Gxy - Gxy_i|/|Gxy_i|)^2
    + 5 ((c - c_i)/c_i)^2 } with W_i = (error_i/least error)^-4 and the coherence c, started at the mean weighted by
    W_i^2. The book divides the real and the imaginary part each by itself, which blows up where one of them passes
    zero; the modulus does not. The problems of all frequencies and pairs are solved at once (Gauss-Newton, damped).

    Args:
        input_power, output_power, cross: spectra per window, NaN where a window has none, shape (n_windows, ...).
        error: random error of each, same shape.

    Returns:
        Input power, output power and cross spectrum, shape (...); NaN where no window has any.
    """
    shape = cross.shape[1:]
    gxx, gyy, error = (np.reshape(a, (len(a), -1)).T for a in (input_power, output_power, error))
    gxy = np.reshape(cross, (len(cross), -1)).T
    known = np.isfinite(gxx) & np.isfinite(gyy) & np.isfinite(gxy) & (gxx > 0) & (gyy > 0) & (np.abs(gxy) > 0)
    any_known = known.any(axis=1)
    out_xx, out_yy = np.full(len(gxx), np.nan), np.full(len(gxx), np.nan)
    out_xy = np.full(len(gxx), np.nan, dtype=np.complex128)
    rows = np.flatnonzero(any_known)
    if rows.size:
        k = known[rows]
        filled = np.where(k, gxx[rows], 1.0), np.where(k, gyy[rows], 1.0), np.where(k, gxy[rows], 1.0)
        held = np.maximum(np.where(k, error[rows], np.inf), 1e-6)
        weight = np.where(k, (held / held.min(axis=1, keepdims=True)) ** -4.0, 0.0)
        x, y, z = _solve(*filled, weight)
        out_xx[rows], out_yy[rows], out_xy[rows] = x, y, z
    return out_xx.reshape(shape), out_yy.reshape(shape), out_xy.reshape(shape)


def _solve(gxx: Array, gyy: Array, gxy: Complex, weight: Array) -> tuple[Array, Array, Complex]:
    first = weight**2 / np.sum(weight**2, axis=1, keepdims=True)
    x0, y0, z0 = ((first * a).sum(axis=1) for a in (gxx, gyy, gxy))
    size = np.maximum(np.abs(z0), 1e-300)
    # Unknowns relative to their start, so that four numbers of any unit weigh alike.
    ratios = gxx / x0[:, None], gyy / y0[:, None], gxy / size[:, None]
    coherence_0 = np.minimum(np.abs(z0) ** 2 / (x0 * y0), 1.0)
    coherence = np.abs(gxy) ** 2 / (gxx * gyy) / coherence_0[:, None]
    t = np.stack([np.ones_like(x0), np.ones_like(x0), z0.real / size, z0.imag / size], axis=1)
    root = np.sqrt(weight)
    damping = np.full(len(t), 1e-3)
    residual, slopes = _residuals(t, ratios, coherence, root)
    cost = np.sum(residual**2, axis=1)
    for _ in range(_ITERATIONS):
        turned = slopes.swapaxes(1, 2)
        normal, gradient = turned @ slopes, (turned @ residual[..., None])[..., 0]
        normal = normal + (damping[:, None] * np.trace(normal, axis1=1, axis2=2)[:, None] / 4.0)[..., None] * np.eye(4)
        trial = t - np.linalg.solve(normal, gradient[..., None])[..., 0]
        trial[:, :2] = np.maximum(trial[:, :2], 1e-3)
        new_residual, new_slopes = _residuals(trial, ratios, coherence, root)
        new_cost = np.sum(new_residual**2, axis=1)
        better = new_cost < cost
        t[better], residual[better], slopes[better] = trial[better], new_residual[better], new_slopes[better]
        settled = np.all(~better | (cost - new_cost <= 1e-10 * (1.0 + cost)))
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, damping / 10.0, damping * 10.0)
        if settled and np.all(damping > 1e-2):
            break
    x, y, z = t[:, 0] * x0, t[:, 1] * y0, (t[:, 2] + 1j * t[:, 3]) * size
    # A coherence above one is none: rounding or windows that contradict each other.
    over = np.abs(z) ** 2 / (x * y)
    return x, np.where(over > 1.0, y * over, y), z


def _residuals(t: Array, ratios: tuple[Array, Array, Complex], coherence: Array, root: Array) -> tuple[Array, Array]:
    """Weighted residuals (p, 5 n_windows) and their derivatives (p, 5 n_windows, 4)."""
    rx, ry, rz = ratios
    x, y, re, im = (t[:, i, None] for i in range(4))
    modulus = np.abs(rz)
    fitted = (re**2 + im**2) / (x * y)
    five = np.sqrt(5.0) / coherence
    zero = np.zeros_like(rx)
    blocks = [
        ((x - rx) / rx, (1.0 / rx, zero, zero, zero)),
        ((y - ry) / ry, (zero, 1.0 / ry, zero, zero)),
        ((re - rz.real) / modulus, (zero, zero, 1.0 / modulus, zero)),
        ((im - rz.imag) / modulus, (zero, zero, zero, 1.0 / modulus)),
        (
            five * (fitted - coherence),
            (-five * fitted / x, -five * fitted / y, five * 2.0 * re / (x * y), five * 2.0 * im / (x * y)),
        ),
    ]
    residual = np.concatenate([root * r for r, _ in blocks], axis=1)
    slopes = np.concatenate([np.stack([root * d for d in ds], axis=-1) for _, ds in blocks], axis=1)
    return residual, slopes
