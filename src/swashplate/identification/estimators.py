"""Estimators: ways from data to a `Result`, of which `identify` takes the one that suits model and data.

A method's name says where the gain that corrects the states along a record comes from (`GAINS`), for every model; what
else there is (errors ahead by `horizon`, wind, a residual, constants of records) is asked for beside it. A new one is a
file with an object of the protocol `Estimator` and a line in `ESTIMATORS` (or an entry point of the group
`swashplate.estimators` in another package).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, Protocol

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.card import Card
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.traits import Free
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.registry import Registry

Data = tuple[Flight, ...] | FrequencyResponse

Gain = Literal["none", "from the noise", "free"]

GAINS: Mapping[str, Gain] = {"output-error": "none", "filter-error": "from the noise", "prediction-error": "free"}
"""Where the gain of each method in time comes from, in the field's words (Jategaonkar 2015, ch. 4 and 5; Ljung 1999,
sec. 7.3): output error corrects nothing, filter error takes the Kalman gain of the noise that it estimates, prediction
error has the innovations form, whose gain is free."""


@dataclass(frozen=True)
class Question:
    """What an identification is asked beside the model and the data; None and empty: nothing was said.

    Attributes:
        free: a ready choice of the vehicle or names; "full" where nothing is said and the vehicle has that choice. A
            state-space model says itself what is free.
        tie: "name = expression" each. fix: values of parameters that are not to move.
        prior: mean and standard deviation by name.
        prior_card: a card from the bench or from another flight: see `parameterize`.
        outputs: measured channels to fit.
        iterations: at most this many.
        keep_unexcited: also free parameters of axes that the flights do not move independently.
        wind: estimate a horizontal wind that acts through the equations (filter error of tracked helicopters only).
        leave_out: stamps (start, stop) [s] of stretches that the filter passes and nothing is learnt from, as where the
            aircraft was touched (`Contact.intervals`; as `wind`).
        environment: wind, density and gravity, for equations of your own.
        shifts: constants in the states' rates, per record (None: for state-space models alone).
        biases: outputs with a constant of their own, per record.
        gusts: of filter error for state-space models, "white" (None) or "lasting", which move the air that the states
            u, v, w fly through.
        horizon: seconds ahead, first and last: after maximum likelihood, make errors FIRST, 2 FIRST, ... LAST seconds
            ahead small, predicted from the filter's states (`core.multi_step`). Bounds are those of this criterion,
            corrected for predictions that overlap.
        residual: also fit accelerations that the equations lack, linear in motion and inputs (`models.residual`), as
            far as blocks of these flights, left out, speak for them; to the innovations together with the physics, or
            with `horizon` to the errors ahead, the physics held. `result.problems` says what it gained, its part of
            each acceleration and which physics moved.
        progress: told the iteration and the cost.
    """

    free: str | Sequence[str | Free] | None = None
    tie: Sequence[str] = ()
    fix: Mapping[str, float] | None = None
    prior: Mapping[str, tuple[float, float]] | None = None
    prior_card: Card | None = None
    outputs: Sequence[str] | None = None
    iterations: int | None = None
    keep_unexcited: bool = False
    wind: bool = False
    leave_out: Sequence[tuple[float, float]] = ()
    environment: Environment | None = None
    shifts: bool | None = None
    biases: Sequence[str] = ()
    gusts: str | None = None
    horizon: Sequence[float] | None = None
    residual: bool = False
    progress: Callable[[int, float], None] | None = None

    def __post_init__(self) -> None:
        for name in ("tie", "outputs", "leave_out", "biases", "horizon"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else tuple(value))

    @property
    def asked(self) -> dict[str, Any]:
        """What was said, by name; who is told of progress is no question to an estimator."""
        every = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "progress"}
        return {
            name: value for name, value in every.items() if value is not None and value is not False and value != ()
        }


class Estimator(Protocol):
    """One way from data to a result."""

    @property
    def takes(self) -> frozenset[str]:
        """Names of the parts of a `Question` that it heeds; others are refused before it is asked."""
        ...

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        """Why it cannot serve for this model and these data, in words; "" where it can."""
        ...

    def estimate(self, model: Any, data: Any, question: Question) -> Result[object, object]:
        """The result."""
        ...


ESTIMATORS: Registry[Estimator] = Registry(
    "estimators",
    what="method of identification",
    own={
        "filter-error": "swashplate.identification.time.identify:FILTER_ERROR",
        "output-error": "swashplate.identification.time.identify:OUTPUT_ERROR",
        **{
            f"{method}/vehicle": f"swashplate.identification.time.vehicle_problem:{method.replace('-', '_').upper()}"
            for method in ("filter-error", "prediction-error", "output-error")
        },
        **{
            f"{method}/linear": f"swashplate.identification.time.linear_problem:{method.replace('-', '_').upper()}"
            for method in GAINS
        },
        "frequency-responses": "swashplate.identification.frequency.state_space_fit:FREQUENCY_RESPONSES",
    },
)
"""By "METHOD", or "METHOD/KIND" where a method has forms for several kinds of model: the first that suits is taken."""


def check_method(method: str | None) -> None:
    """That some estimator is of that method.

    Raises:
        IdentificationError: with the methods that there are.
    """
    methods = list(dict.fromkeys(name.split("/")[0] for name in ESTIMATORS))
    if method is not None and method not in methods:
        raise IdentificationError(f"method is '{method}', expected one of {', '.join(methods)}.")
