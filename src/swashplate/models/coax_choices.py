"""The coaxial helicopter's ready choices of what an identification may move."""

from __future__ import annotations

from swashplate.models.traits import Choice, Free, PhysicalEffect

_PAPER_TIES = ("a_beta_u = a_alpha_v", "a_beta_v = a_alpha_u", "a_beta_q = a_alpha_p")
_LINEAR_TIES = (
    "a_beta_u_linear = a_alpha_v_linear",
    "a_beta_v_linear = a_alpha_u_linear",
    "a_beta_q_linear = a_alpha_p_linear",
)
_CARD = "the published card, half its value"
_LAG = "the published card, 0.3 rad"

_SPEEDS = "scatter of the bench's speed map about its line (bench_input_to_rpm, 0.40 to 0.75)"
_TENTH = "the card, a tenth: one rotor turns in the other's wake"

_FULL = (
    Free("linkage_lower", 0.0678, 0.1355, 0.0678, source=_CARD),
    Free("tau_f_lower", 0.04, 0.08, 0.04, source=_CARD),
    Free("o_zeta_lower", 0.3, -0.0094, 0.3, source=_LAG),
    Free("o_zeta_upper", 0.3, -0.1789, 0.3, source=_LAG),
    Free("tau_f_upper", 0.8, 1.6, 0.8, source=_CARD),
    Free("hub_stiffness_upper", 0.0542, 0.1084, 0.0542, source=_CARD),
    Free("a_alpha_p_linear", 0.02, 0.021, 0.021, 0.021, "16 / (gamma Omega), gamma about 3.2"),
    Free("a_alpha_v_linear", 0.02, 0.021, 0.021, 0.021, "flap-back of both rotors, 2 x 0.0103 rad s/m"),
    Free("a_alpha_u_linear", 0.02, 0.0, 0.021, source="at most the flap-back"),
    Free("gyroscopic", 0.5, 0.5, 0.5, 0.5, "between none and that of rigid rotors"),
    Free("damping_r", 8.8e-4, 8.8e-4, 8.8e-4, 8.8e-4, "2 (k_Q Omega) of both rotors"),
    Free("damping_w", 0.3, 0.3, 0.3, 0.3, "momentum theory in hover"),
    Free("inertia_zz", 1.4e-4, 2.7786e-4, 1.4e-4, source=_CARD),
    Free("tau_drive_upper", 0.09, 0.185, 0.09, source=_CARD),
    Free("tau_drive_lower", 0.06, 0.115, 0.06, source=_CARD),
)
_BALANCE = (
    Free("k_torque_upper", 5e-8, 9.9708e-7, 1e-7, source=_TENTH),
    Free("k_thrust_upper", 1e-6, 2.2607e-5, 2.3e-6, source=_TENTH),
    Free("trim_motor_upper", 0.005, 0.0, 0.005, source=_SPEEDS),
    Free("trim_motor_lower", 0.005, 0.0, 0.007, source=_SPEEDS),
    Free("tau_gust_yaw", 1.0, source="how long gusts of yaw last"),
    Free("drift_yaw", 1.0, source="how yaw drifts"),
    Free("tau_gust_vertical", 1.0, source="how long gusts of heave last"),
    Free("drift_vertical", 1.0, source="how heave drifts"),
)
_SYMMETRY = "symmetry, give or take what bent levers, unlike servos and a skew bar make of it"
_ASYMMETRY = (
    Free("linkage_asymmetry_lower", 0.1, 0.0, 0.15, source=_SYMMETRY),
    Free("phase_asymmetry_lower", 0.1, 0.0, 0.15, source=_SYMMETRY),
    Free("linkage_asymmetry_upper", 0.1, 0.0, 0.15, source=_SYMMETRY),
)
_TIES = (*_PAPER_TIES, *_LINEAR_TIES)
_BALANCED_TIES = (*_TIES, "k_thrust_lower = 3.1531e-05 / 2.2607e-05 * k_thrust_upper")
_SET = (("bar_heading_transport", 1.0),)

CHOICES: dict[str, Choice] = {
    "flight": Choice(
        "flight",
        "the six parameters that the paper identifies in flight (Fankhauser et al., sec. IV-B)",
        (
            Free("a_alpha_v", 0.0125),
            Free("a_alpha_u", 0.0125),
            Free("a_alpha_p", 0.012),
            Free("tau_f_upper", 1.0),
            Free("o_zeta_upper", 0.1),
            Free("o_zeta_lower", 0.1),
        ),
        _PAPER_TIES,
    ),
    "full": Choice(
        "full",
        "what a slow flight can tell: servo and bar effectiveness, lags, linear flap-back, rotor and heave damping",
        _FULL,
        _TIES,
        _SET,
    ),
    "balanced": Choice(
        "balanced",
        "full, and what balances torque and weight: the upper rotor's torque, both thrusts, motor trims of every "
        "record; gusts and drifts of yaw and heave with numbers of their own",
        (*_FULL, *_BALANCE),
        _BALANCED_TIES,
        _SET,
    ),
    "asymmetric": Choice(
        "asymmetric",
        "balanced, and how servos, swashplate phase and bar differ between roll and pitch",
        (*_FULL, *_BALANCE, *_ASYMMETRY),
        _BALANCED_TIES,
        _SET,
    ),
}
"""The coaxial helicopter's ready choices, by name."""

EFFECTS = (
    PhysicalEffect("gyroscopic moment of the rotors", {"gyroscopic": 0.0}),
    PhysicalEffect("damping of the discs by roll and pitch rate", {"a_alpha_p_linear": 0.0}),
    PhysicalEffect("flap-back linear in speed", {"a_alpha_v_linear": 0.0, "a_alpha_u_linear": 0.0}),
    PhysicalEffect("damping of yaw", {"damping_r": 0.0}),
    PhysicalEffect("bar that keeps its plane while the heading turns", {"bar_heading_transport": 0.0}),
    PhysicalEffect(
        "roll and pitch unlike each other",
        {"linkage_asymmetry_lower": 0.0, "phase_asymmetry_lower": 0.0, "linkage_asymmetry_upper": 0.0},
    ),
    PhysicalEffect("damping of heave", {"damping_w": 0.0}),
)
"""Parts of the physics that numbers can leave out."""
