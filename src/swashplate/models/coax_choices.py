"""The coaxial helicopter's ready choices of what an identification may move."""

from __future__ import annotations

from swashplate.models.choices import Choice, Free

_PAPER_TIES = ("a_beta_u = a_alpha_v", "a_beta_v = a_alpha_u", "a_beta_q = a_alpha_p")
_LINEAR_TIES = (
    "a_beta_u_linear = a_alpha_v_linear",
    "a_beta_v_linear = a_alpha_u_linear",
    "a_beta_q_linear = a_alpha_p_linear",
)
_CARD = "the published card, half its value"
_LAG = "the published card, 0.3 rad"

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
        (
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
        ),
        (*_PAPER_TIES, *_LINEAR_TIES),
        (("bar_heading_transport", 1.0),),
    ),
}
"""The coaxial helicopter's ready choices, by name."""
