"""The verbs of `swash`, in the order of a journey under the doors of the README, each with its question."""

from __future__ import annotations

from dataclasses import dataclass, field

LOOK, FLIGHTS, MODELS, MORE = (
    "From a log to gains",
    "From flights to a model",
    "A model to simulate, control and export",
    "Benches, many runs, data",
)
"""The doors: what stands above their verbs in `swash --help`."""


@dataclass(frozen=True)
class Verb:
    """A verb, or a group of them.

    Attributes:
        help: one line.
        question: "module:Class" in `swashplate.api.verbs`; "" for a group.
        door: above which heading it stands.
        verbs: of a group.
        usual: the verb of a group that need not be typed.
    """

    help: str
    question: str = ""
    door: str = ""
    verbs: dict[str, Verb] = field(default_factory=dict)
    usual: str = ""


VERBS: dict[str, Verb] = {
    "open": Verb("Look at any log in the browser: plots, problems, sweeps, gains.", "look:Open", LOOK),
    "inspect": Verb("Show what is in logs and what is wrong with them; plot them.", "look:Inspect", LOOK),
    "respond": Verb("Frequency responses from logs of sweeps.", "respond:Respond", LOOK),
    "identify": Verb("Identify a model from flights or responses, with a report.", "identify:Identify", FLIGHTS),
    "track": Verb("Estimate along a log, sample by sample as on board.", "track:TrackLog", FLIGHTS),
    "validate": Verb("Predict flights with a model and judge the predictions.", "validate:Validate", FLIGHTS),
    "compare": Verb("Responses, models or fits side by side.", "validate:Compare", FLIGHTS),
    "maneuver": Verb(
        "Excitations to fly: checked, designed, or what the next flight needs.",
        door=FLIGHTS,
        usual="check",
        verbs={
            "check": Verb("Check an excitation against the design rules, and write it.", "maneuver:CheckManeuver"),
            "design": Verb("Design the excitation that determines unknown parameters best.", "maneuver:DesignManeuver"),
            "need": Verb("Say how far the next flight must move, and what else it needs.", "maneuver:NeedManeuver"),
        },
    ),
    "vehicle": Verb(
        "Vehicles: list, show, make, trim, linearize, stitch.",
        door=MODELS,
        usual="show",
        verbs={
            "list": Verb("List the vehicles that come with swashplate.", "vehicle:ListVehicles"),
            "show": Verb("Describe a vehicle and every number of it.", "vehicle:ShowVehicle"),
            "new": Verb("Write a card for your own helicopter, to be measured.", "vehicle:NewVehicle"),
            "trim": Verb("Find steady flight, at one speed or over a range.", "steady:TrimVehicle"),
            "linearize": Verb("Linear models and modes about steady flight.", "steady:LinearizeVehicle"),
            "derivatives": Verb("Stability and control derivatives, by contributor.", "steady:FindDerivatives"),
            "stitch": Verb("One model from linear models at several speeds.", "vehicle:StitchModels"),
            "structures": Verb("Structures of linear models, and the equations of one.", "vehicle:ShowStructures"),
        },
    ),
    "simulate": Verb("Fly a maneuver and save the flight.", "simulate:Simulate", MODELS),
    "live": Verb("Fly a model in the browser, or look at a flight there.", "live:Live", MODELS),
    "control": Verb(
        "Controllers: gains, design, check, decouple, many flights.",
        door=MODELS,
        verbs={
            "gains": Verb("Gains of ArduPilot or PX4 for a vehicle, with margins.", "control:FindGains"),
            "design": Verb("Design an LQG or LQR controller with integral action.", "control:DesignController"),
            "check": Verb("Margins, handling qualities and steps of a controller.", "control:CheckController"),
            "decouple": Verb("Decouple the axes of a coaxial helicopter or a linear model.", "decouple:Decouple"),
            "monte-carlo": Verb("Fly a controller on many aircraft in many gusts.", "simulate:FlyMany"),
        },
    ),
    "link": Verb(
        "Fly a vehicle under a running autopilot.",
        door=MODELS,
        verbs={
            "ardupilot": Verb("Be the physics of ArduPilot's SITL.", "link:LinkArduPilot"),
            "px4": Verb("Be the simulator of PX4's SITL.", "link:LinkPx4"),
            "betaflight": Verb("Be the physics of Betaflight's SITL.", "link:LinkBetaflight"),
            "rotorflight": Verb("Be the physics of a SITL of Rotorflight.", "link:LinkRotorflight"),
            "parameters": Verb("Write an autopilot's parameters and gains for a vehicle.", "link:WriteParameters"),
            "check": Verb("Read a running autopilot's parameters, and judge them.", "link:CheckAutopilot"),
            "accept": Verb("Start, fly and judge a SITL binary of ArduPilot or Betaflight.", "link:Accept"),
        },
    ),
    "export": Verb("Write a model as C, an FMU, an S-function, .mat or JSON.", "export:ExportModel", MODELS),
    "bench": Verb(
        "From a folder of bench records to a parameter card.",
        door=MORE,
        usual="evaluate",
        verbs={
            "evaluate": Verb("Evaluate records into a card.", "bench:EvaluateBench"),
            "plan": Verb("Print the measurement plan.", "bench:PlanBench"),
            "simulate": Verb("Make the records of the virtual bench.", "bench:SimulateBench"),
        },
    ),
    "campaign": Verb(
        "Compute many flights, fits or logs on every core of one machine or of several.",
        door=MORE,
        verbs={
            "run": Verb("Compute a campaign, or continue one.", "campaign:RunCampaign"),
            "resume": Verb("Continue a campaign where it stopped.", "campaign:ResumeCampaign"),
            "status": Verb("Show the progress and the results so far.", "campaign:ShowCampaign"),
            "report": Verb("Write the results as a page or a table.", "campaign:ReportCampaign"),
            "replay": Verb("Compute one row again.", "campaign:ReplayRow"),
        },
    ),
    "data": Verb(
        "List and download public data sets.",
        door=MORE,
        verbs={
            "list": Verb("List the files of every data set, and where each is.", "data:ListData"),
            "fetch": Verb("Download the missing files of a data set.", "data:FetchData"),
        },
    ),
    "demo": Verb("Run the main job on real or simulated flights.", "data:Demo", MORE),
}
"""All of them. A group's help and its verbs stand here; what a verb takes stands in its question."""
