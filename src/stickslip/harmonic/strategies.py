"""Names and options of the strategies in `stickslip.harmonic.selection`, for study files."""

# name → file and class
STRATEGIES = {
    "jacobian_alert": ("jacobian_alert", "JacobianAlert"),
    "guarded_alert": ("guarded_alert", "GuardedAlert"),
    "goal_oriented": ("goal_oriented", "GoalOriented"),
    "grolet": ("grolet", "Grolet"),
    "jaumouille": ("jaumouille", "Jaumouille"),
    "laxalde": ("laxalde", "Laxalde"),
    "maple": ("maple", "Maple"),
    "suess_jacobian": ("suess_jacobian", "SuessJacobian"),
    "suess_spectral": ("suess_spectral", "SuessSpectral"),
    "always_low": ("fixed", "AlwaysLow"),
    "always_high": ("fixed", "AlwaysHigh"),
}
VERIFYING = frozenset({"jacobian_alert", "guarded_alert", "goal_oriented"})  # they predict an error
FIXED = frozenset({"always_low", "always_high"})  # they always accept
OPTIONS = {  # option → strategies that have it
    "per_dof": ("grolet", "maple"),
    "repeats": ("grolet", "laxalde", "suess_jacobian", "suess_spectral"),
}


def options_of(name: str) -> tuple[str, ...]:
    """Return the options of a strategy: ``per_dof``, ``repeats``, or both."""
    return tuple(option for option, having in OPTIONS.items() if name in having)
