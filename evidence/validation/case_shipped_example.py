"""The shipped example as a user runs it, automatic harmonics and all: every peak against integration in time.

A peak holds where the motion in time that begins with it stays there and its amplitude differs by at most 1 %, or where the run itself calls
the case doubtful or wrong.
"""

import tempfile

import numpy as np

from evidence.models.two_blades import SHIPPED
from evidence.validation.compare import Record, record
from stickslip.api.study import Study

CASE = "Two blades and a damper, as shipped"
TOLERANCE = 0.01


def run() -> list[Record]:
    """Run the example with ``--verify`` and compare at the peak of each ratio."""
    with tempfile.TemporaryDirectory() as folder:
        result = Study.from_file(SHIPPED).run(verify=True, folder=folder)
        data = result["forced_response"].load()
    records = []
    for i, label in enumerate(data.case_label.values):
        own = np.flatnonzero(
            (data.verify_case.values == i) & (data.verify_frequency_hz.values == data.peak_frequency_hz.values[i])
        )
        balance, transient = (float(data[name].values[own[-1]]) for name in ("verify_balance", "verify_transient"))
        motion = str(data.verify_motion.values[own[-1]])
        case = ("trusted", "doubtful", "wrong")[int(data.case_verdict.values[i])]
        name = f"{label}, peak at {data.peak_frequency_hz.values[i]:.3f} Hz, {case}, motion in time {motion}, m"
        made = record(CASE, name, balance, transient, TOLERANCE, "time integration")
        records.append({**made, "holds": bool(made["holds"] and motion == "attained") or case != "trusted"})
    return records
