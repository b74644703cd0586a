"""An estimator of your own: least squares of the equations' rates against the slopes of measured states."""

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.result import Estimate, Result, correlation_of
from swashplate.identification.core.sources import sources_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.environment import Environment


class RateLeastSquares:
    """For a first look: nothing is integrated, and noise in the measured states biases what it finds."""

    takes = frozenset({"free", "fix"})  # what of `sp.identify`'s arguments it heeds

    def unsuited(self, model, data):
        """Why it cannot serve, "" where it can."""
        if not (isinstance(model, Vehicle) and isinstance(data, tuple)):
            return "it fits vehicles to records in time"
        missing = [name for name in model.state_names if not all(name in flight for flight in data)]
        return f"the flights do not have the states {', '.join(missing)}" if missing else ""

    def estimate(self, model, data, question):
        table = parameterize(model, question.free or "full", fixed=question.fix)
        air, xp = Environment(), ArrayBackend()
        pieces = [piece for flight in data for piece in flight.split()]
        states = [piece.array(model.state_names) for piece in pieces]
        inputs = [piece.array(model.input_names) for piece in pieces]
        steps = [1.0 / piece.rate(model.state_names[0]) for piece in pieces]
        slopes = [savgol_filter(x, 5, 4, deriv=1, delta=dt, axis=0) for x, dt in zip(states, steps, strict=True)]
        size = np.concatenate(slopes).std(axis=0) + 1e-9

        def errors(row):
            par = table.layout.values(table.card_row, row)
            told = [np.stack(model.rates(x.T, u.T, par, air, xp), axis=1) for x, u in zip(states, inputs, strict=True)]
            return np.concatenate([((a - b) / size).ravel() for a, b in zip(told, slopes, strict=True)])

        best = least_squares(errors, table.starts(), bounds=table.bounds(), x_scale="jac")
        covariance = np.linalg.inv(best.jac.T @ best.jac) * 2.0 * best.cost / (best.fun.size - best.x.size)
        card = model.card.parameters
        names, sigma = table.names, np.sqrt(np.diag(covariance))
        estimates = tuple(
            Estimate(name, card[name].unit, card[name].value, float(value), float(spread))
            for name, value, spread in zip(names, best.x, sigma, strict=True)
        )
        identified = table.vehicle.with_values(dict(zip(names, map(float, best.x), strict=True)), status="identified")
        return Result(
            method="rate-least-squares", solution=identified, start=model, estimates=estimates, names=names,
            covariance=covariance, covariance_corrected=np.full_like(covariance, np.nan), details=None,
            correlation=correlation_of(covariance), converged=bool(best.success), data=sources_of(data),
        )  # fmt: skip


ESTIMATOR = RateLeastSquares()
