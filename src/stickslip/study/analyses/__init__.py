"""The questions that a study may ask, one line each: name of the table -> module and its instance, and the class of the table.

A file is judged by the tables alone; the analyses, with all that they compute, are loaded when it is found good.
"""

ANALYSES = {
    "forced_response": "stickslip.study.analyses.forced_response.analysis:FORCED_RESPONSE",
    "quasi_periodic": "stickslip.study.analyses.quasi_periodic.analysis:QUASI_PERIODIC",
    "limit_cycle": "stickslip.study.analyses.limit_cycle.analysis:LIMIT_CYCLE",
    "nonlinear_mode": "stickslip.study.analyses.nonlinear_mode.analysis:NONLINEAR_MODE",
    "residual_tractions": "stickslip.study.analyses.residual_tractions.analysis:RESIDUAL_TRACTIONS",
    "modal_synthesis": "stickslip.study.analyses.modal_synthesis.analysis:MODAL_SYNTHESIS",
    "modes": "stickslip.study.analyses.waves.modes:MODES",
    "campbell": "stickslip.study.analyses.waves.campbell:CAMPBELL",
    "flutter": "stickslip.study.analyses.waves.flutter:FLUTTER",
    "safe": "stickslip.study.analyses.waves.safe:SAFE",
    "resonance": "stickslip.study.analyses.resonance.analysis:RESONANCE",
    "all_motions": "stickslip.study.analyses.all_motions.analysis:ALL_MOTIONS",
    "run_up": "stickslip.study.analyses.run_up.analysis:RUN_UP",
}
TABLES = {
    "forced_response": "stickslip.study.analyses.forced_response.section:ForcedResponse",
    "quasi_periodic": "stickslip.study.analyses.quasi_periodic.table:QuasiPeriodicTable",
    "limit_cycle": "stickslip.study.analyses.limit_cycle.table:LimitCycleTable",
    "nonlinear_mode": "stickslip.study.analyses.nonlinear_mode.table:NonlinearModeTable",
    "residual_tractions": "stickslip.study.analyses.residual_tractions.table:ResidualTractionsTable",
    "modal_synthesis": "stickslip.study.analyses.modal_synthesis.table:ModalSynthesisTable",
    "modes": "stickslip.study.analyses.waves.tables:ModesTable",
    "campbell": "stickslip.study.analyses.waves.tables:CampbellTable",
    "flutter": "stickslip.study.analyses.waves.tables:FlutterTable",
    "safe": "stickslip.study.analyses.waves.tables:SafeTable",
    "resonance": "stickslip.study.analyses.resonance.table:ResonanceTable",
    "all_motions": "stickslip.study.analyses.all_motions.table:AllMotionsTable",
    "run_up": "stickslip.study.analyses.run_up.table:RunUpTable",
}
