"""How straight the models fly that a fit cannot tell apart, which numbers make the spread, and what takes it out.

    python research/drift_study.py FIT_FOLDER [MODELS]

FIT_FOLDER is what `swash identify --vehicle coax ... --out FIT_FOLDER` wrote. The tables are those of
docs/howto/decouple-and-hold.md; minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import swashplate as sp
from swashplate.control.analysis.straightness import command_for_speed, paths_of, step_paths
from swashplate.control.draws.variations import draw_models
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.laws.learning import corrected_by_step
from swashplate.simulation.closed_loop_batch import simulate_closed_loops

SPEED, TAUGHT = 1.8, 100


def told(drift: Any) -> str:
    low, middle, high = np.nanpercentile(drift, [5, 50, 95])
    return f"{low:+.2f} to {high:+.2f} m, median {middle:+.2f} m, 1 sigma {np.nanstd(drift):.2f} m"


def main(folder: Path, models: int) -> None:
    vehicle = sp.vehicle(folder / "model.toml")
    hover = sp.trim(vehicle, voltage=vehicle.card.values()["voltage_nominal"])
    drawn = draw_models(vehicle, folder / "fit.json", count=models, seed=0)
    law, bare = (autopilot(vehicle, hover, mode="manual", decoupled=on) for on in (True, False))
    command = command_for_speed(vehicle, law, hover, speed=SPEED)

    def flown(controller: Any, step: float = command, **numbers: Any) -> Any:
        size = len(next(iter(numbers.values()))) if numbers else 1
        given = numbers or None
        return step_paths(vehicle, controller, hover, command=step, duration=14.0, size=size, parameters=given).drift

    print(f"step {command:.3f}; identified: without {flown(bare)[0]:+.2f} m, with {flown(law)[0]:+.2f} m")
    print("without", told(flown(bare, **drawn)))
    drift = flown(law, **drawn)
    print("with   ", told(drift))
    alone: dict[bytes, list[str]] = {}
    for name, values in drawn.items():
        alone.setdefault(values.tobytes(), []).append(name)  # tied numbers move together
    for names in alone.values():
        print("alone  ", names[0], told(flown(law, **{name: drawn[name] for name in names})))
    for on in (True, False):
        held = simulate_closed_loops(
            vehicle,
            autopilot(vehicle, hover, mode="speed", decoupled=on),
            duration=14.0,
            size=models,
            parameters=drawn,
            reference={"ahead": SPEED},
            start=hover,
        )
        print(f"speed held, decoupled {on}:", told(paths_of(held, SPEED, 6.0).drift))
    taught = []
    for i in range(min(TAUGHT, models)):
        own = {name: values[i : i + 1] for name, values in drawn.items()}
        corrected = corrected_by_step(vehicle, law, hover, command=command, drift=float(drift[i]))
        taught.append([flown(corrected, step, **own)[0] for step in (command, 0.5 * command)])
    for column, words in enumerate(("taught", "taught, half the step")):
        print(words, told(np.array(taught)[:, column]))
    print("half the step, not taught", told(flown(law, 0.5 * command, **drawn)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 500)
