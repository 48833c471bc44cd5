"""Registry of the analyses that a study may request, with the addresses of their functions, tables and sections of the page.

A study file is checked with the tables only; the analyses are imported after the file has passed. The order in the registry is the
order of computation, of terminal tables and of the page.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True)
class Home:
    """Addresses ``module:name`` of the objects that define an analysis.

    Parameters
    ----------
    analysis
        Address of its `Analysis`.
    table
        Address of the pydantic class of its table; empty: a study file cannot request it.
    page
        Address of its `Section` of the page; empty: it has none.
    axes
        Names of the variables that become coordinates of its dataset, such as the frequencies of a response.
    """

    analysis: str
    table: str = ""
    page: str = ""
    axes: tuple[str, ...] = ()


def loaded(address: str) -> Any:
    """Return the object at an address ``module:name``; its module is imported at this call."""
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)


def _folder(name: str, analysis: str, table: str, page: str = "page", axes: tuple[str, ...] = ()) -> Home:
    """Return the addresses of an analysis that has its own folder."""
    own = f"stickslip.analyses.{name}"
    return Home(f"{own}.analysis:{analysis}", f"{own}.table:{table}", f"{own}.{page}:SECTION", axes)


_WAVE = ("nodal_diameter", "wave_number", "wave_kind")  # coordinates of analyses of small vibrations by waves


def _waves(name: str, table: str, axes: tuple[str, ...] = ()) -> Home:
    """Return the addresses of an analysis of small vibrations by waves."""
    own = "stickslip.analyses.waves"
    return Home(f"{own}.{name}:{name.upper()}", f"{own}.tables:{table}", f"{own}.page.{name}:SECTION", (*_WAVE, *axes))


OWN_ANALYSIS = "own_analysis"  # attribute of the node of a user's analysis: its address
# names of the variables that become coordinates
_HZ = ("frequency_hz",)
_SYNTHESIS = ("frequency_hz", "backbone_frequency_hz", "direct_frequency_hz", "passage_frequency_hz")
_RUN_UP = ("speed_rpm", "frequency_hz", "line_speed_rpm", "static_speed_rpm", "fast_speed_rpm")

ANALYSES = {
    "forced_response": _folder("forced_response", "FORCED_RESPONSE", "ForcedResponse", "page.chapter"),
    "nonlinear_mode": _folder("nonlinear_mode", "NONLINEAR_MODE", "NonlinearModeTable", axes=_HZ),
    "modal_synthesis": _folder("modal_synthesis", "MODAL_SYNTHESIS", "ModalSynthesisTable", axes=_SYNTHESIS),
    "quasi_periodic": _folder("quasi_periodic", "QUASI_PERIODIC", "QuasiPeriodicTable", axes=("first_hz", "second_hz")),
    "limit_cycle": _folder("limit_cycle", "LIMIT_CYCLE", "LimitCycleTable", axes=_HZ),
    "resonance": _folder("resonance", "RESONANCE", "ResonanceTable", axes=("value",)),
    "all_motions": _folder("all_motions", "ALL_MOTIONS", "AllMotionsTable", axes=("frequency_hz", "searched_hz")),
    "residual_tractions": _folder("residual_tractions", "RESIDUAL_TRACTIONS", "ResidualTractionsTable", axes=_HZ),
    "modes": _waves("modes", "ModesTable"),
    "campbell": _waves("campbell", "CampbellTable", axes=("speed_rpm", "engine_orders", "crossing_engine_order")),
    "flutter": _waves("flutter", "FlutterTable"),
    "safe": _waves("safe", "SafeTable", axes=("pair_engine_order",)),
    "run_up": _folder("run_up", "RUN_UP", "RunUpTable", axes=_RUN_UP),
}
