"""Which pairs of responses a fit uses, and over which bands: limits for all, for some, and pairs that are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from swashplate.errors import IdentificationError
from swashplate.identification.frequency.response_cost import Target, ceiling, target
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.registry import nearest

Band = tuple[float, float]

TWINS = {"mixer_roll": "lateral", "mixer_pitch": "longitudinal", "mixer_yaw": "pedal", "mixer_collective": "collective"}
"""ArduPilot's mixer inputs and what the structures of whole helicopters call the same."""


@dataclass(frozen=True)
class PairChoice:
    """What is fitted.

    Attributes:
        band: limits [Hz] of all pairs. bands: of some, by "output/input", input or output, the first that is given.
        without: pairs that are not used, by the same names. least_coherence: from which a response is used.
    """

    band: Band | None = None
    bands: Mapping[str, Band] = field(default_factory=dict)
    without: Sequence[str] = ()
    least_coherence: float = LEAST_COHERENCE

    def check(self, responses: FrequencyResponse) -> None:
        """That every name is one of the responses'.

        Raises:
            IdentificationError: naming it, and what it may stand for.
        """
        pairs = [f"{o}/{i}" for o in responses.outputs for i in responses.inputs]
        known = (*responses.outputs, *responses.inputs, *pairs)
        for what, names in (("a band", self.bands), ("'without'", self.without)):
            for name in names:
                if name.replace(" ", "") not in known:
                    raise IdentificationError(
                        f"{what} is given for '{name}', which is no output, no input and no pair output/input of the "
                        f"responses: they have outputs {', '.join(responses.outputs)} and inputs "
                        f"{', '.join(responses.inputs)}.",
                        hint=nearest(name, known),
                    )

    def band_of(self, output: str, input: str) -> Band | None:
        """Limits of a pair [Hz]."""
        by_pair = {name.replace(" ", ""): limits for name, limits in self.bands.items()}
        return next((by_pair[name] for name in (f"{output}/{input}", input, output) if name in by_pair), self.band)

    def leaves_out(self, output: str, input: str) -> bool:
        """Whether a pair is not used."""
        return bool({name.replace(" ", "") for name in self.without} & {f"{output}/{input}", input, output})

    def settings(self) -> dict[str, Any]:
        """What a result keeps of it."""
        settings: dict[str, Any] = {
            "least_coherence": self.least_coherence,
            "band_hz": list(self.band) if self.band else None,
        }
        settings |= {"bands_hz": {name: list(limits) for name, limits in self.bands.items()}} if self.bands else {}
        return settings | ({"without": list(self.without)} if self.without else {})

    def targets(
        self, model: StateSpaceModel, responses: FrequencyResponse
    ) -> tuple[list[Target], list[Target], tuple[str, ...]]:
        """Coherent responses that model and flight share, ceilings of those that are not, and the names of the latter.

        Raises:
            IdentificationError: nothing is shared, nothing is coherent, or a name that the responses do not have.
        """
        self.check(responses)
        shared_in = [name for name in model.inputs if name in responses.inputs]
        shared_out = [name for name in model.outputs if name in responses.outputs]
        if not shared_in or not shared_out:
            raise IdentificationError(
                f"the model has inputs {', '.join(model.inputs)} and outputs {', '.join(model.outputs)}; the responses "
                f"have {', '.join(responses.inputs)} and {', '.join(responses.outputs)}: they share nothing to fit.",
                where=f"model '{model.name}'"
                + (f", responses of {', '.join(responses.sources)}" if responses.sources else ""),
                hint=_other_names(model, responses)
                or "Name the channels as the model does (--rename NAME=CHANNEL), or take another model.",
            )
        targets, ceilings, missing = [], [], []
        for output in shared_out:
            for name in shared_in:
                if self.leaves_out(output, name):
                    continue
                band = self.band_of(output, name)
                one = target(responses, output, name, band=band, least=self.least_coherence)
                if one is None:
                    missing.append(f"{output} / {name}")
                    limit = ceiling(responses, output, name, band=band)
                    ceilings += [] if limit is None else [limit]
                else:
                    targets.append(one)
        if not targets:
            left = f"; left out as asked: {', '.join(self.without)}" if self.without else ""
            raise IdentificationError(
                f"no response keeps a coherence of {self.least_coherence:g} over a band: "
                f"{', '.join(missing) or 'none is left'}{left}.",
                hint="Nothing can be fitted; look at the responses and fly a better sweep.",
            )
        return targets, ceilings, tuple(missing)


def _other_names(model: StateSpaceModel, responses: FrequencyResponse) -> str:
    """The option that gives the responses' inputs the model's names, where they are known by both."""
    twins = {**TWINS, **{theirs: ours for ours, theirs in TWINS.items()}}
    pairs = [
        f"{twins[name]}={name}"
        for name in responses.inputs
        if twins.get(name) in model.inputs and twins[name] not in responses.inputs
    ]
    return f"Say --rename {','.join(pairs)}." if pairs else ""
