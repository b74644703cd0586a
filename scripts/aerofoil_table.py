"""Writes the packaged aerofoil table `naca0012` from formulas: an approximation, and no measurement.

    python scripts/aerofoil_table.py

What it is made of, for a symmetric profile of 12 % thickness (sources recalled, not opened again):
* lift slope by angle 0.1025 + 0.00485 log10(Re / 1e6) per degree (McCroskey 1987, NASA TM 100019; fitted above 2e6,
  continued below), divided by the Prandtl-Glauert factor sqrt(1 - M^2), to Mach 0.75;
* lift through stall by Kirchhoff's flow: c_n = slope ((1 + sqrt f) / 2)^2 a, with the separation point f of two
  exponentials (Leishman and Beddoes 1989), set so that the largest lift is that below; then a flat plate (Hoerner
  1965);
* largest lift 1.1 + 0.4 log10(Re / 1e6), at least 0.6, at low Mach numbers: a line through what Sheldahl and Klimas
  (1981, SAND80-2114) and Abbott and von Doenhoff (1959) measured between 4e4 and 9e6, to about 0.1; falling by 1.1 per
  Mach number above 0.3 of itself (assumed: the trend of published tables for this profile);
* least drag: laminar friction 2.656 / sqrt Re with the form factor 1 + 2 t + 60 t^4 (Hoerner 1965), and 0.006 of a
  profile that is turbulent behind the nose (Abbott and von Doenhoff 1959), added as squares;
* drag by angle: what separation takes from the suction at the nose (Leishman and Beddoes 1989: recovery 0.95);
* drag by Mach number: 20 (M - M_crit)^4 (Lock), M_crit = 0.87 - t - |c_l| / 10 - (0.1 / 80)^(1/3) (Korn; Mason 1990);
* moment about the quarter chord 0 before stall, and a flat plate's as far as the flow is separated.

Hysteresis, laminar bubbles (below Re 1e5 they bend the lift line), and the drag bucket are not in it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

THICKNESS = 0.12
MACHS = (0.0, 0.2, 0.35, 0.5, 0.6, 0.7, 0.75, 0.8, 0.9)
REYNOLDS = (3e4, 1e5, 3e5, 1e6, 1e7)
ANGLES = np.concatenate([np.arange(-30.0, -20.0, 2.0), np.arange(-20.0, 20.5, 1.0), np.arange(22.0, 31.0, 2.0)])
RECOVERY = 0.95
TARGET = Path(__file__).parents[1] / "src" / "swashplate" / "models" / "data" / "aerofoils" / "naca0012.csv"


def lift_slope(mach: float, reynolds: float) -> float:
    """Per radian."""
    low = np.degrees(0.1025 + 0.00485 * np.log10(reynolds / 1e6))
    return float(low / np.sqrt(1.0 - min(mach, 0.75) ** 2))


def largest_lift(mach: float, reynolds: float) -> float:
    """Before stall."""
    slow = max(0.6, 1.1 + 0.4 * np.log10(reynolds / 1e6))
    return float(slow * (1.0 - 1.1 * max(0.0, mach - 0.3)))


def least_drag(reynolds: float) -> float:
    """At no lift, without compressibility."""
    laminar = 2.656 / np.sqrt(reynolds) * (1.0 + 2.0 * THICKNESS + 60.0 * THICKNESS**4)
    return float(np.hypot(laminar, 0.006))


def separation(angle: np.ndarray, stall: float) -> np.ndarray:
    """Kirchhoff's separation point over the chord, from 1 (attached) to 0; 0.7 at the angle `stall` [rad]."""
    a = np.abs(angle)
    before = 1.0 - 0.3 * np.exp(np.minimum(0.0, a - stall) / np.radians(2.0))
    after = 0.04 + 0.66 * np.exp(np.minimum(0.0, stall - a) / np.radians(3.0))
    return np.where(a <= stall, before, after)


def attached(angle: np.ndarray, slope: float, stall: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of normal and chordwise (suction) force in Kirchhoff's flow."""
    f = separation(angle, stall)
    return slope * (0.5 * (1.0 + np.sqrt(f))) ** 2 * angle, RECOVERY * slope * angle**2 * np.sqrt(f)


def coefficients(mach: float, reynolds: float, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lift, drag and moment at angles [rad]."""
    slope, most = lift_slope(mach, reynolds), largest_lift(mach, reynolds)
    fine = np.radians(np.linspace(0.0, 25.0, 2501))

    def peak(stall: float) -> float:  # far beyond stall lift rises again
        near = fine[fine <= stall + np.radians(3.0)]
        normal, suction = attached(near, slope, stall)
        return float(np.max(normal * np.cos(near) + suction * np.sin(near)))

    low, high = 0.0, np.radians(25.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if peak(middle) < most else (low, middle)
    normal, suction = attached(angle, slope, low)
    plate = np.clip((np.abs(angle) - low - np.radians(4.0)) / np.radians(10.0), 0.0, 1.0)
    plate = plate * plate * (3.0 - 2.0 * plate)
    normal, suction = (1.0 - plate) * normal + plate * 2.0 * np.sin(angle), (1.0 - plate) * suction
    c, s = np.cos(angle), np.sin(angle)
    lift = normal * c + suction * s
    critical = 0.87 - THICKNESS - 0.1 * np.minimum(np.abs(lift), most) - (0.1 / 80.0) ** (1.0 / 3.0)
    wave = 20.0 * np.maximum(0.0, mach - critical) ** 4
    drag = least_drag(reynolds) + np.maximum(0.0, normal * s - suction * c) + wave
    behind = (1.0 - np.sqrt(separation(angle, low))) / (1.0 - np.sqrt(0.04))
    moment = -np.sin(angle) * np.abs(angle) / np.pi * np.clip(behind, 0.0, 1.0)
    return lift, drag, moment


def table_text() -> str:
    """The file."""
    lines = [
        "# name: like NACA 0012, an approximation",
        "# source: computed by scripts/aerofoil_table.py from thin-aerofoil, Kirchhoff and friction formulas cited"
        " there; no measurement",
        "mach,reynolds,alpha_deg,cl,cd,cm",
    ]
    for mach in MACHS:
        for reynolds in REYNOLDS:
            columns = coefficients(mach, reynolds, np.radians(ANGLES))
            lines += [
                f"{mach:g},{reynolds:g},{angle:g},{lift + 0.0:.4f},{drag:.5f},{moment + 0.0:.4f}"
                for angle, lift, drag, moment in zip(ANGLES, *columns, strict=True)
            ]
    return "\n".join(lines).replace(",-0.0000", ",0.0000") + "\n"


def main() -> None:
    """Write the table."""
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text(table_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
