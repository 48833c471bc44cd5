"""The questions that a study may ask, one line each: name of the table -> module and its instance, and the class of the table.

A file is judged by the tables alone; the analyses, with all that they compute, are loaded when it is found good.
"""

ANALYSES = {
    "forced_response": "stickslip.study.analyses.forced_response:FORCED_RESPONSE",
    "quasi_periodic": "stickslip.study.analyses.quasi_periodic:QUASI_PERIODIC",
    "limit_cycle": "stickslip.study.analyses.limit_cycle:LIMIT_CYCLE",
    "nonlinear_mode": "stickslip.study.analyses.nonlinear_mode:NONLINEAR_MODE",
    "residual_tractions": "stickslip.study.analyses.residual_tractions:RESIDUAL_TRACTIONS",
    "modal_synthesis": "stickslip.study.analyses.modal_synthesis:MODAL_SYNTHESIS",
    "modes": "stickslip.study.analyses.modes:MODES",
    "campbell": "stickslip.study.analyses.campbell:CAMPBELL",
    "flutter": "stickslip.study.analyses.flutter:FLUTTER",
    "safe": "stickslip.study.analyses.safe:SAFE",
    "resonance": "stickslip.study.analyses.resonance:RESONANCE",
    "all_motions": "stickslip.study.analyses.all_motions:ALL_MOTIONS",
    "run_up": "stickslip.study.analyses.run_up:RUN_UP",
}
TABLES = {
    "forced_response": "stickslip.study.analyses.forced.section:ForcedResponse",
    "quasi_periodic": "stickslip.study.analyses.two_frequencies.table:QuasiPeriodicTable",
    "limit_cycle": "stickslip.study.analyses.cycles.table:LimitCycleTable",
    "nonlinear_mode": "stickslip.study.analyses.backbones.table:NonlinearModeTable",
    "residual_tractions": "stickslip.study.analyses.tractions.table:ResidualTractionsTable",
    "modal_synthesis": "stickslip.study.analyses.synthesis.table:ModalSynthesisTable",
    "modes": "stickslip.study.analyses.waves.tables:ModesTable",
    "campbell": "stickslip.study.analyses.waves.tables:CampbellTable",
    "flutter": "stickslip.study.analyses.waves.tables:FlutterTable",
    "safe": "stickslip.study.analyses.waves.tables:SafeTable",
    "resonance": "stickslip.study.analyses.resonances.table:ResonanceTable",
    "all_motions": "stickslip.study.analyses.motions.table:AllMotionsTable",
    "run_up": "stickslip.study.analyses.running.table:RunUpTable",
}
