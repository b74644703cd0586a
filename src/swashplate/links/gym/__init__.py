"""Gymnasium environments: hover, a trajectory and an attitude sweep on any vehicle of this package.

Importing this package registers `swashplate/Hover-v0`, `swashplate/Trajectory-v0` and `swashplate/Sweep-v0`:

    import gymnasium
    import swashplate.links.gym
    env = gymnasium.make("swashplate/Hover-v0", vehicle="raptor50")
    envs = gymnasium.make_vec("swashplate/Hover-v0", 256, "vector_entry_point", vehicle="raptor50")

`gymnasium.make("swashplate.links.gym:swashplate/Hover-v0", vehicle="raptor50")` imports it by itself. (Gymnasium 1.0
took the entry points away by which packages were registered without being named.)

Needs the extra `rl` (Gymnasium: Towers et al. 2024).
"""

from __future__ import annotations

from swashplate.errors import SwashError

try:
    import gymnasium
except ImportError:
    raise SwashError("needs gymnasium.", channel="links.gym", hint="Install swashplate with the extra 'rl'.") from None

for _name in ("Hover", "Trajectory", "Sweep"):
    if f"swashplate/{_name}-v0" not in gymnasium.registry:
        gymnasium.register(
            id=f"swashplate/{_name}-v0",
            entry_point="swashplate.links.gym.environment:HelicopterEnv",
            vector_entry_point="swashplate.links.gym.vector:HelicopterVectorEnv",
            kwargs={"task": _name.lower()},
        )
