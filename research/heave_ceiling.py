"""What can be known of a Crazyflie's heave, flight by flight, and does the battery's state tell more of it?

Three routes to the acceleration along body z below 3 Hz: the tracked place (differentiated twice), the accelerometer,
and commands with voltage and motion (a regression of the flight's own, each block predicted by the others). If
their errors have nothing in common, their covariances tell the share of each that is true (triple collocation:
Stoffelen 1998). Straight from the files' columns; nothing of the package's vehicle, filter or reader is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.signal import butter, find_peaks, lfilter, savgol_filter, sosfiltfilt
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.flights import datasets

TRAINING = {"B8_star_fast_rep1": 36.0, "B3_figure8_fast_rep1": 21.0, "B3_figure8_medium_rep2": 36.0,
            "B2_circle_slow_rep2": 36.0}  # fmt: skip
UNSEEN = {"B2_circle_fast_rep2": 37.0, "B8_star_medium_rep1": 37.0, "B6_linear_ramp_rep2": 27.0,
          "B5_helix_fast_rep2": 37.0, "B5_helix_medium_rep1": 37.0, "B10_lissajous_fast_rep1": 37.0}  # fmt: skip
BEGIN, TOLD = 6.0, 5.0  # s: what counts begins; the seconds that tell a flight's constant
DT, SLOW, LAG, WARM, G = 0.01, 3.0, 0.07, 9.0, 9.81  # s, Hz, s (rotors, all alike), s, m/s^2
SOS = butter(4, SLOW, fs=1.0 / DT, output="sos")


def slow(x: Array) -> Array:
    return np.asarray(sosfiltfilt(SOS, x, axis=0))


def lagged(x: Array, tau: float) -> Array:
    keep = np.exp(-DT / tau)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], x - x[0], axis=0) + x[0])


@dataclass
class Read:
    """One flight: clock, duties (n, 4), voltage, body velocity (z up), and the two sensors below 3 Hz."""

    t: Array
    duty: Array
    voltage: Array
    moving: Array
    place: Array
    tracked: Array
    felt: Array
    told: slice
    kept: slice
    estimated: Array | None = None

    @property
    def volts(self) -> Array:
        return self.voltage if self.estimated is None else self.estimated


def read(name: str, end: float) -> Read:
    path = datasets.find("nanobench", f"{name}.csv")
    if path is None:
        raise SystemExit(f"{name}.csv is not here")
    head = path.open().readline().strip().split(",")
    data = np.loadtxt(path, delimiter=",", skiprows=1)
    clock = data[:, 0] - data[0, 0]
    t = np.arange(0.0, clock[-1], DT)

    def of(*names: str) -> Array:
        return np.stack([np.interp(t, clock, data[:, head.index(name)]) for name in names], axis=1)

    turned = Rotation.from_quat(of("qx", "qy", "qz", "qw"))
    pushed = savgol_filter(of("px", "py", "pz"), 5, 2, deriv=2, delta=DT, axis=0) + np.array([0.0, 0.0, G])
    tracked, felt = turned.apply(pushed, inverse=True)[:, 2], slow(of("imu_acc_z")[:, 0] * G)
    kept = slice(round((BEGIN + TOLD) / DT), round(end / DT))
    late = max(range(-15, 16), key=lambda k: float(np.corrcoef(slow(np.roll(tracked, k))[kept], felt[kept])[0, 1]))
    moving = np.roll(turned.apply(of("vx", "vy", "vz"), inverse=True), late, axis=0)
    place = np.roll(of("px", "py", "pz"), late, axis=0)
    duty = of(*(f"motor_motor_m{i}" for i in (1, 2, 3, 4))) / 65535.0
    told = slice(round(BEGIN / DT), kept.start)
    return Read(t, duty, of("pwr_pm_vbat")[:, 0], moving, place, slow(np.roll(tracked, late)), felt, told, kept)


Column = Callable[[Read], Array]


def columns(flight: Read, more: Iterable[Column] = ()) -> Array:
    """What thrust follows: rotor speeds squared, flow through the discs, warmth, the voltage by itself."""
    speeds = lagged(flight.duty * flight.volts[:, None], LAG)
    cold = np.exp(-flight.t / WARM)
    rows = [(speeds**2).sum(1), flight.moving[:, 2] * speeds.sum(1), cold, flight.volts, *(one(flight) for one in more)]
    return np.stack([slow(row) for row in rows], axis=1)


def fitted(flights: list[Read], more: Iterable[Column] = ()) -> Array:
    """Coefficients that flights share, each with a constant of its own."""
    both = [(columns(f, more)[f.told.start : f.kept.stop], f.tracked[f.told.start : f.kept.stop]) for f in flights]
    x, y = (np.concatenate([part[i] - part[i].mean(0) for part in both]) for i in (0, 1))
    return np.asarray(np.linalg.lstsq(x, y, rcond=None)[0])


def scores(flight: Read, found: Array, more: Iterable[Column] = ()) -> tuple[float, float, Array]:
    """R^2 with the best constant, with that of the first seconds, and what is left (n,)."""
    off = flight.tracked - columns(flight, more) @ found
    spread, left = flight.tracked[flight.kept].var(), off[flight.kept]
    return 1 - left.var() / spread, 1 - np.mean((left - off[flight.told].mean()) ** 2) / spread, left - left.mean()


def ceiling(flight: Read) -> tuple[float, Array, float, Array, float]:
    """R^2: of the sensors; the true share of the tracked, its band and value; of what commands tell, band and value."""
    x, y = columns(flight, [lambda f: f.t])[flight.kept], flight.tracked[flight.kept]
    x, told = np.column_stack([x, np.ones(len(x))]), np.empty(len(x))
    every = np.arange(len(x))
    for block in np.array_split(every, 5):
        others = every[(every < block[0] - 50) | (every > block[-1] + 50)]
        told[block] = x[block] @ np.linalg.lstsq(x[others], y[others], rcond=None)[0]
    three = np.stack([y, flight.felt[flight.kept], told])

    def true(c: Array) -> tuple[float, float]:
        return c[0, 1] * c[0, 2] / (c[1, 2] * c[0, 0]), c[0, 2] * c[1, 2] / (c[0, 1] * c[2, 2])

    blocks, rng = np.array_split(every, max(4, len(x) // 300)), np.random.default_rng(1)
    drawn = [np.concatenate([blocks[i] for i in rng.integers(len(blocks), size=len(blocks))]) for _ in range(500)]
    bands = np.percentile([true(np.cov(three[:, i])) for i in drawn], [2.5, 97.5], axis=0).T
    tracking, commands = true(np.cov(three))
    return float(np.corrcoef(three[:2])[0, 1] ** 2), bands[0], tracking, bands[1], commands


def battery(flight: Read, numbers: Array, late: int = 0, smooth: bool = False) -> tuple[float, Array]:
    """Minus log-likelihood of the logged voltages, and the terminals' voltage at every sample.

    The open-circuit voltage is a state that wanders and falls with the charge that was drawn; the current, in units of
    a hover's, goes with duty times torque. numbers: drop in hover [V], fall [V/s], wander [V/sqrt(s)], noise [V].
    late: samples by which the log comes after the rotors' torque.
    """
    drop, fall, wander, noise = numbers
    current = (flight.duty * lagged(flight.duty * flight.voltage[:, None], LAG) ** 2).sum(1)
    current = np.roll(current, late) / current[flight.told.start : flight.kept.stop].mean()
    # new values are where the log's straight lines meet
    new = find_peaks(np.concatenate([[0.0], np.abs(np.diff(flight.voltage, 2)), [0.0]]), distance=7)[0]
    new = new[(flight.t[new] > 2.0) & (new < flight.kept.stop + 100)]
    bare, drawn = flight.voltage[new] + drop * current[new], np.cumsum(current)[new] * DT
    gaps = np.diff(flight.t[new], prepend=flight.t[new[0]])
    cost, level, p, seen = 0.0, bare[0], 0.1, []
    for k, value in enumerate(bare):
        level, p = level - fall * (drawn[k] - drawn[k - 1] if k else 0.0), p + wander**2 * gaps[k]
        before = (level, p)
        miss, s = value - level, p + noise**2
        cost += 0.5 * (np.log(s) + miss * miss / s) if k > 5 else 0.0
        level, p = level + p / s * miss, p * (1 - p / s)
        seen.append((*before, level, p))
    if not smooth:
        return cost, flight.voltage
    back = [seen[-1][2]]
    for k in range(len(seen) - 2, -1, -1):
        back.append(seen[k][2] + seen[k][3] / seen[k + 1][1] * (back[-1] - seen[k + 1][0]))
    return cost, np.interp(flight.t, flight.t[new], back[::-1]) - drop * current


def likeliest(flights: list[Read], start: Iterable[float], late: int = 0) -> tuple[Array, float]:
    """Battery's numbers by the flights' voltages alone. A start of exactly 0 stays 0."""
    start = np.array(list(start))
    free = start > 0.0

    def numbers(logs: Array) -> Array:
        all_of_them = start.copy()
        all_of_them[free] = np.exp(logs)
        return all_of_them

    options = {"maxiter": 250, "xatol": 0.02, "fatol": 0.3}
    best = minimize(lambda x: sum(battery(f, numbers(x), late)[0] for f in flights), np.log(start[free]),
                    method="Nelder-Mead", options=options)  # fmt: skip
    return numbers(best.x), float(best.fun)


def own_wake(flight: Read) -> Array:
    """Seconds that the aircraft flew within 0.3 m of here, 0.5 to 15 s ago, fading in 5 s (n,)."""
    few, found = slice(None, None, 5), []
    t, place = flight.t[few], flight.place[few]
    for now, here in zip(t, place, strict=True):
        past = (t < now - 0.5) & (t > now - 15.0) & (place[:, 2] > 0.2)
        away = np.hypot(*(place[past, :2] - here[:2]).T)
        found.append(float(np.sum(np.exp(-((away / 0.3) ** 2) - (now - t[past]) / 5.0))) * 5 * DT)
    return np.interp(flight.t, t, found)


CHANGES: dict[str, list[Column]] = {
    "none": [],
    "climb 0.2 s late": [lambda f: lagged(f.moving[:, 2], 0.2)],
    "climb 1 s late": [lambda f: lagged(f.moving[:, 2], 1.0)],
    "climb squared, with its sign": [lambda f: f.moving[:, 2] * np.abs(f.moving[:, 2])],
    "descent apart": [lambda f: np.minimum(f.moving[:, 2], 0.0)],
    "inflow that takes 0.1 s": [lambda f: lagged((lagged(f.duty * f.volts[:, None], LAG) ** 2).sum(1), 0.1)],
    "its own wake": [own_wake],
    "speed squared": [lambda f: (f.moving[:, :2] ** 2).sum(1)],
}


def row(name: str, first: list[float], second: list[float]) -> str:
    each = [f"{a:.2f} / {b:.2f}" for a, b in zip(first, second, strict=True)]
    return f"| {name} | {np.mean(first):.3f} | {np.mean(second):.3f} | {' | '.join(each)} |"


def main() -> None:
    training, unseen = ({n: read(n, end) for n, end in of.items()} for of in (TRAINING, UNSEEN))
    shared = list(training.values())
    found = fitted(shared)
    for name, flight in (training | unseen).items():
        agreed, low, tracking, band, commands = ceiling(flight)
        best, of_5, left = scores(flight, found)
        sensed = flight.felt[flight.kept] - (columns(flight) @ found)[flight.kept]
        cells = [f"{flight.tracked[flight.kept].std():.2f}", f"{agreed:.2f}"]
        cells += [f"{x:.2f} ({b[0]:.2f} to {b[1]:.2f})" for x, b in ((tracking, low), (commands, band))]
        cells += [f"{best:.2f}", f"{of_5:.2f}", f"{left.std():.3f}", f"{np.corrcoef(left, sensed)[0, 1]:.2f}"]
        print(f"| `{name}` | {' | '.join(cells)} |")
    print("battery alone, wandering:", likeliest(shared, (0.0, 0.0, 0.05, 0.01)))
    by_shift = {late: likeliest(shared, (0.6, 0.003, 0.04, 0.01), late) for late in (0, -6, -3, 3, 6)}
    for late, (numbers, cost) in by_shift.items():
        print(f"with the commands' current, log {late * DT:g} s late:", numbers, cost)
    numbers = by_shift[0][0]

    def left_out(more: list[Column]) -> list[tuple[float, float]]:
        return [scores(f, fitted([g for g in shared if g is not f], more), more)[:2] for f in shared]

    for name, more in CHANGES.items():
        print(row(name, *map(list, zip(*left_out(more), strict=True))))
    judged = {"none": [], "climb 0.2 s late": CHANGES["climb 0.2 s late"]}
    once = {n: [scores(f, fitted(shared, m), m)[:2] for f in unseen.values()] for n, m in judged.items()}
    for name, flight in (training | unseen).items():
        flight.estimated = battery(flight, numbers, smooth=True)[1]
        print(name, "estimated voltage away from the logged, below 3 Hz [V]",
              slow(flight.estimated - flight.voltage)[flight.kept].std())  # fmt: skip
    print(row("battery's state", *map(list, zip(*left_out([]), strict=True))))
    once["battery's state"] = [scores(f, fitted(shared))[:2] for f in unseen.values()]
    for name, told in once.items():
        print("unseen", row(name, *map(list, zip(*told, strict=True))))


if __name__ == "__main__":
    main()
