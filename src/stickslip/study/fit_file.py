"""Output of ``stickslip fit``."""

import math
from pathlib import Path
from typing import Any

from stickslip.contact.loop_fit import LoopFit, fit_loops
from stickslip.errors import InputError
from stickslip.model.readers.measured_columns import read_loops

WIDTH = 24  # characters of the column of names
UNTOLD = "not told"
# options of the command for the arguments of the fit
_OPTIONS = {
    "fit_loops: normal_load": "--normal-load",
    "fit_loops: normal_load_deviation": "--normal-load-deviation",
    "fit_loops: machine_stiffness": "--machine-stiffness",
}


def fit_file(path: Path, **options: Any) -> LoopFit:
    """Fit a contact to the loops of a file; `options` are arguments of `fit_loops`.

    Raises
    ------
    InputError
        If file or options are invalid; the message names the file or the option.
    """
    loops = read_loops(path)
    try:
        return fit_loops(loops, **options)
    except InputError as error:
        own = _OPTIONS.get(error.place, f"{path}{error.place.removeprefix('fit_loops: loops')}")
        raise error.at(own) from None


def estimates(fit: LoopFit) -> list[str]:
    """Return a line for each estimate with its standard deviation."""
    off = fit.deviations
    samples = sum(x.size for x, _ in fit.loops)
    swing = max(float(f.max() - f.min()) for _, f in fit.loops)
    n = len(fit.loops)
    rows = {
        "samples": f"{samples} in {n} recording{'s' * (n != 1)}",
        "tangential stiffness": _value(fit.k_t, off["k_t"], "N/m", fit.least[0]),
        "limit force": _value(fit.limit, off["limit"], "N", fit.least[1]),
    }
    if fit.normal_load is not None:
        load = fit.normal_load
        rows["friction coefficient"] = _value(fit.mu, off["mu"], "", fit.least[1] / load)
        exact = not fit.normal_load_deviation
        own = f"{load:g} N" if exact else _value(load, fit.normal_load_deviation, "N")
        rows["normal load"] = f"{own}, given{', taken for exact' * exact}"
    both = float(fit.covariance[0, 1]) / (off["k_t"] * off["limit"])
    if math.isfinite(both):
        rows["correlation"] = f"{both:.2f} of stiffness and limit force"
    rows["residual"] = f"{fit.residual:.3g} N, {100 * fit.residual / swing:.2g} % of the force's range"
    return [f"{name:<{WIDTH}}{value}" for name, value in rows.items()]


def study_lines(fit: LoopFit) -> list[str]:
    """Return the lines for a contact table of a study file."""
    head = ['per = "interface"   # the whole contact that was measured']
    limit = {True: "friction_coefficient", False: "slip_limit_n"}[fit.normal_load is not None]
    value, off = (fit.mu, fit.deviations["mu"]) if fit.normal_load else (fit.limit, fit.deviations["limit"])
    stiffness = _line("tangential_stiffness_n_per_m", fit.k_t, fit.deviations["k_t"])
    own = [stiffness, _line(limit, value, off)]
    if fit.normal_load is None:
        return ['law = "jenkins"', *head, *own]
    axial = _line("axial_stiffness_n_per_m", fit.k_t, fit.deviations["k_t"])
    return [
        'law = "elastic_coulomb"',
        *head,
        *own,
        f"{axial}: taken to be the same along the other tangent",
        "# normal_stiffness_n_per_m: a loop at constant normal load does not tell it",
    ]


def _line(key: str, value: float, deviation: float) -> str:
    if math.isnan(value):
        return f"# {key}: {UNTOLD}"
    return f"{key} = {_rounded(value, deviation)}   # ± {deviation:.2g}"


def _value(value: float, deviation: float, unit: str, least: float = math.nan) -> str:
    """Return ``1.234 ± 0.012 N``; for an undetermined value its lower bound."""
    if math.isnan(value):
        bound = f", at least {least:.4g} {unit}".rstrip() if math.isfinite(least) else ""
        return UNTOLD + bound
    return f"{_rounded(value, deviation)} ± {deviation:.2g} {unit}".rstrip()


def _rounded(value: float, deviation: float) -> str:
    """Return a value rounded to the second digit of its standard deviation."""
    digits = 6
    if 0 < deviation < abs(value):
        digits = min(math.floor(math.log10(abs(value))) - math.floor(math.log10(deviation)) + 2, 10)
    return f"{value:.{digits}g}"
