"""A vehicle that hovers, for Gymnasium: `gymnasium.make("gym_hover:swashplate/Hover-v0", vehicle="coax")`."""

import gymnasium
import numpy as np

import swashplate as sp
from swashplate.simulation.stepping import Stepping

LIMITS = np.array([50.0] * 6 + [np.pi] * 3 + [20.0] * 3, dtype=np.float32)
FAR = 10.0  # m from its place, where an episode is lost


class HoverEnv(gymnasium.Env):
    """Hold the place where the episode's trim is.

    Observation (12, float32): place and velocity in body axes less the trim's [m, m/s], roll, pitch and heading [rad],
    body rates [rad/s]. Action: -1 to 1 for each input, added to the trim's; 1 is `authority` of the input's range.
    Reward: exp(-(place / 1 m)^2 - (velocity / 2 m/s)^2 - (attitude / 0.5 rad)^2), -10 where the vehicle is lost.
    """

    def __init__(self, vehicle="coax", *, rate=50.0, duration=10.0, authority=0.2, spread=0.3):
        self.vehicle = sp.vehicle(vehicle) if isinstance(vehicle, str) else vehicle
        self.trim, self.period, self.steps = sp.trim(self.vehicle), 1.0 / rate, round(duration * rate)
        low, high = np.array(self.vehicle.input_limits).T
        self.reach, self.spread = authority * (high - low), spread
        self.observation_space = gymnasium.spaces.Box(-LIMITS, LIMITS)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(low),), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.row, self.k = np.array(self.trim.state), 0
        self.row[:3] += self.spread * self.np_random.uniform(-1.0, 1.0, 3)
        self.moving = Stepping(self.vehicle, self.row, self.trim.environment)
        return self._seen(), {"state": self.row.copy()}

    def step(self, action):
        inputs = self.trim.inputs + self.reach * np.clip(action, -1.0, 1.0)
        try:
            self.row = np.array(self.moving.advance(inputs, self.period).states)
            lost = bool(np.linalg.norm(self.row[:3] - self.trim.state[:3]) > FAR)
        except sp.SwashError:  # beyond the finite numbers
            lost = True
        self.k += 1
        off = self._seen().astype(float)
        scales = np.repeat([1.0, 2.0, 0.5], 3)
        reward = -10.0 if lost else float(np.exp(-np.sum((off[:9] / scales) ** 2)))
        return self._seen(), reward, lost, self.k >= self.steps and not lost, {"state": self.row.copy()}

    def _seen(self):
        off = self.row[:12] - np.array(self.trim.state[:12])
        return np.clip(off, -LIMITS, LIMITS).astype(np.float32)


gymnasium.register("swashplate/Hover-v0", entry_point=HoverEnv)
