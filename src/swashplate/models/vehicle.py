"""`Vehicle`: named states and inputs, bare numbers, and one pure function that gives the states' derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from swashplate.arrays import Array, Complex
from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter
from swashplate.models.linear.answering import LinearResponse
from swashplate.models.linear.state_space import ModelParameter, StateSpaceModel
from swashplate.models.nesting import leaves, rebuild
from swashplate.models.surroundings import environment_of
from swashplate.models.traits import Choice, Role, Traits
from swashplate.models.usual_axes import usual_axes
from swashplate.physics.backend import Backend, FloatBackend, Named
from swashplate.physics.environment import Environment
from swashplate.physics.rigid_body import RigidBody
from swashplate.public import resolve

_FLOATS = FloatBackend()
Derivatives = Callable[[Any, Any, Any, Environment, Backend], Any]


@dataclass(frozen=True)
class Vehicle:
    """Something that flies.

    Attributes:
        card: its numbers, with their sources.
        state: a nested template whose leaves, in order, are `state_names`.
        inputs: a named tuple type of the inputs.
        parameters: a named tuple type of the parameters.
        state_names, state_units: the flat states.
        input_names, input_units, input_limits: the inputs, their units and their (lower, upper).
        derivatives: `derivatives(state, inputs, parameters, environment, xp)` in nested form.
        specific_force: what accelerometers at the CG read [m/s^2], same arguments, returns three scalars.
        trim_held: inputs that a trim does not solve for, with their values (a throttle that a governor stands behind).
        traits: what the rest of the package must know of it.
        options: the switches of the equations, where they are more than the card's options.
        structure: of a state-space model, its matrices of named expressions; None for all others.
    """

    card: Card
    state: Named
    inputs: Named
    parameters: Named
    state_names: tuple[str, ...]
    state_units: tuple[str, ...]
    input_names: tuple[str, ...]
    input_units: tuple[str, ...]
    input_limits: tuple[tuple[float, float], ...]
    derivatives: Derivatives
    specific_force: Derivatives
    trim_held: tuple[tuple[str, float], ...] = ()
    traits: Traits = field(default_factory=Traits, repr=False, compare=False)
    options: Any = None
    structure: StateSpaceModel | None = field(default=None, repr=False)

    @property
    def name(self) -> str:
        """Of its equations."""
        return self.card.vehicle

    @property
    def called(self) -> str:
        """What a reader should see: its equations' name, or its own title where many models share such a name."""
        return self.card.title if self.traits.linear else self.name

    @property
    def roles(self) -> tuple[Role, ...]:
        """What each state is, in their order: as declared, else by its unit (`Traits.roles`)."""
        known: dict[str, Role] = {**dict.fromkeys(RigidBody._fields, "body"), **self.traits.roles}
        by_unit: list[Role] = ["rotor speed" if unit == "rad/s" else "other" for unit in self.state_units]
        return tuple(known.get(name, usual) for name, usual in zip(self.state_names, by_unit, strict=True))

    @property
    def rotor_speeds(self) -> tuple[str, ...]:
        """States that are speeds at which something turns."""
        return tuple(name for name, role in zip(self.state_names, self.roles, strict=True) if role == "rotor speed")

    @property
    def stick_axes(self) -> Mapping[str, Mapping[str, float]]:
        """Inputs by the axis that moves them, roll, pitch, yaw and heave: the largest share is one."""
        axes = self.traits.axes or usual_axes(self.input_names)
        largest = {axis.name: max(abs(share) for share in axis.inputs.values()) for axis in axes}
        return {axis.name: {name: share / largest[axis.name] for name, share in axis.inputs.items()} for axis in axes}

    @property
    def choices(self) -> Mapping[str, Choice]:
        """Ready choices of what an identification may move, by name."""
        return self.traits.choices(self.card)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(self.parameters._fields)

    @property
    def numbers(self) -> Mapping[str, Parameter | ModelParameter]:
        """What may be fitted or varied, by name: the parameters of its structure where it has one, else of its card."""
        return self.card.parameters if self.structure is None else self.structure.parameters

    def values(self) -> Any:
        """The card's numbers as the equations want them."""
        numbers = self.card.values()
        return self.parameters(*(numbers[name] for name in self.parameter_names))

    def rates(
        self, x: Any, u: Any, parameters: Named, environment: Environment | None = None, xp: Backend = _FLOATS
    ) -> list[Any]:
        """Derivatives of the flat state row `x` under the flat input row `u`, as a list in the order of the states.

        In calm air of its own (`environment_of`) and on plain floats where nothing else is said.
        """
        nested = rebuild(self.state, [x[i] for i in range(len(self.state_names))])
        commands = self.inputs(*(u[i] for i in range(len(self.input_names))))
        around = environment_of(self, environment, parameters=parameters)
        return list(leaves(self.derivatives(nested, commands, parameters, around, xp)))

    def index(self, state: str) -> int:
        """Place of a state in the flat row."""
        return self.state_names.index(state)

    def with_card(self, card: Card) -> Vehicle:
        """The same equations with another card's numbers."""
        if card.vehicle != self.card.vehicle:
            raise CardError(f"is for '{card.vehicle}', not for '{self.card.vehicle}'.", where=card.path)
        return replace(self, card=card)

    def with_values(self, values: Mapping[str, float], **changes: Any) -> Vehicle:
        """A copy with other numbers (see `Card.with_values`)."""
        return replace(self, card=self.card.with_values(values, **changes))

    def save(self, path: str | Path) -> Path:
        """Write the card as a model file."""
        from swashplate.atomic import write_text

        return write_text(path, self.card.to_toml())

    def trim(self, **asked: Any) -> Any:
        """Its steady flight: the arguments of `swashplate.trim`."""
        return resolve("trim")(self, **asked)

    def linearize(self, trim: Any = None) -> Any:
        """Its linear model about a trim, hover where none is given: see `swashplate.linearize`."""
        return resolve("linearize")(self, trim)

    def as_linear(self) -> LinearResponse:
        """The linear model: of its structure, else about hover (about another trim: `swashplate.linearize`).

        Raises:
            SwashError: for a vehicle that has no hover.
        """
        linear: LinearResponse = resolve("linearize")(self) if self.structure is None else self.structure
        return linear

    def response(self, omega: Array) -> Complex:
        """H(j omega) of the linear model (`as_linear`), shape (n, n_outputs, n_inputs).

        Outputs are the structure's own; of a vehicle without one its states. Inputs are `input_names`.

        Args:
            omega: frequencies [rad/s].

        Raises:
            SwashError: for a vehicle that has no hover.
        """
        return self.as_linear().response(omega)

    def to_control(self, *, pade: int | None = None) -> Any:
        """The linear model as a `control.StateSpace` of python-control: of its structure, else about hover.

        About another trim: `swashplate.linearize(vehicle, trim).to_control()`.

        Args:
            pade: order of the polynomials that stand for the delays; 0 leaves the delays out, None does so with a
                warning where there are any.

        Raises:
            SwashError: an order outside 0 to 12, or a vehicle that has no hover.
        """
        model: Any = self.as_linear()
        return model.to_control(pade=pade)

    def __repr__(self) -> str:
        return (
            f"Vehicle {self.name}: {self.card.title} ({len(self.state_names)} states, {len(self.input_names)} inputs)"
        )
