"""The analyses that a study may ask for, one line each: name of the table -> module and its instance, and the class of the table.

A file is judged by the tables alone; the analyses, with all that they compute, are loaded when it is found good.
"""

ANALYSES = {
    "forced_response": "stickslip.analyses.forced_response.analysis:FORCED_RESPONSE",
    "quasi_periodic": "stickslip.analyses.quasi_periodic.analysis:QUASI_PERIODIC",
    "limit_cycle": "stickslip.analyses.limit_cycle.analysis:LIMIT_CYCLE",
    "nonlinear_mode": "stickslip.analyses.nonlinear_mode.analysis:NONLINEAR_MODE",
    "residual_tractions": "stickslip.analyses.residual_tractions.analysis:RESIDUAL_TRACTIONS",
    "modal_synthesis": "stickslip.analyses.modal_synthesis.analysis:MODAL_SYNTHESIS",
    "modes": "stickslip.analyses.waves.modes:MODES",
    "campbell": "stickslip.analyses.waves.campbell:CAMPBELL",
    "flutter": "stickslip.analyses.waves.flutter:FLUTTER",
    "safe": "stickslip.analyses.waves.safe:SAFE",
    "resonance": "stickslip.analyses.resonance.analysis:RESONANCE",
    "all_motions": "stickslip.analyses.all_motions.analysis:ALL_MOTIONS",
    "run_up": "stickslip.analyses.run_up.analysis:RUN_UP",
}
TABLES = {
    "forced_response": "stickslip.analyses.forced_response.table:ForcedResponse",
    "quasi_periodic": "stickslip.analyses.quasi_periodic.table:QuasiPeriodicTable",
    "limit_cycle": "stickslip.analyses.limit_cycle.table:LimitCycleTable",
    "nonlinear_mode": "stickslip.analyses.nonlinear_mode.table:NonlinearModeTable",
    "residual_tractions": "stickslip.analyses.residual_tractions.table:ResidualTractionsTable",
    "modal_synthesis": "stickslip.analyses.modal_synthesis.table:ModalSynthesisTable",
    "modes": "stickslip.analyses.waves.tables:ModesTable",
    "campbell": "stickslip.analyses.waves.tables:CampbellTable",
    "flutter": "stickslip.analyses.waves.tables:FlutterTable",
    "safe": "stickslip.analyses.waves.tables:SafeTable",
    "resonance": "stickslip.analyses.resonance.table:ResonanceTable",
    "all_motions": "stickslip.analyses.all_motions.table:AllMotionsTable",
    "run_up": "stickslip.analyses.run_up.table:RunUpTable",
}
