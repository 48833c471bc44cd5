"""Assembly of a single structure, a tuned or a mistuned wheel; also with more modes, for comparison."""

from dataclasses import replace
from math import ceil
from typing import Any

from stickslip.assembly.assembled import Assembled
from stickslip.assembly.build import assemble_tuned
from stickslip.assembly.forces import refuse_second
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store, in_memory
from stickslip.assembly.sides.mistuned import assemble_mistuned
from stickslip.errors import StickslipError, input_error
from stickslip.model.part import Part
from stickslip.reduction.choice import Reduction
from stickslip.reduction.truncation import FrequencyError, ModeChoice, ModesBelow

MORE = 1.5  # factor on the number of modes, or on the frequency up to which modes are kept
FINER = 4.0  # factor by which a requested error of frequencies is reduced
REMEMBERED_AS = "with more modes"


def assemble(
    model: Model,
    harmonics: int,
    store: Store = in_memory,
    *,
    wave_number: int | None = None,
    every_wave: bool = False,
    linear: bool = False,
) -> Assembled:
    """Reduce the parts of a model, join them, pair the contacts, and apply the static loads.

    Parameters
    ----------
    model
        The model.
    harmonics
        Highest harmonic of the response.
    store
        Cache of reductions: a function of a key text and of a function that computes named arrays. It returns the
        arrays, from an earlier run if available.
    wave_number
        Wave number of a self-excited motion of a wheel; harmonic loads are then left out. None: it follows from the
        loads.
    every_wave
        Whether all waves of a wheel are reduced, as for stability against every wave.
    linear
        Whether a model may have no contact; its outputs are then the unknowns.

    Raises
    ------
    InputError
        If the model is inconsistent. The message names the place.
    SingularError
        If a body has no support, or there is no equilibrium under the static loads.
    """
    if wave_number is not None:
        model = model.undriven
    if not (linear or model.pairs.names):
        raise input_error(
            "contact",
            "there is none, and this analysis is about contacts",
            "Give a contact, or ask for [forced_response] or [modes].",
        )
    refuse_second(model.loads)
    if model.mistuning is not None:
        return assemble_mistuned(model, harmonics, store)
    return assemble_tuned(model, harmonics, store, wave_number, every_wave=every_wave)


def with_more_modes(model: Model) -> Model | None:
    """Return the model with half again as many modes; None if its parts keep all modes already."""
    own = {name: _more(part) for name, part in model.parts.items()}
    if all(own[name] is part for name, part in model.parts.items()):
        return None
    return replace(model, parts=own)


def more_modes(model: Model, harmonics: int, store: Store) -> Assembled | None:
    """Assemble a model with half again as many modes; None if it keeps all modes already, or the reduction fails.

    Parameters
    ----------
    model
        The solved model. For a wheel whose sectors differ the result is None.
    harmonics, store
        As in `assemble`.
    """
    more = with_more_modes(model) if model.mistuning is None else None
    if more is None:
        return None
    try:
        return assemble_tuned(more, harmonics, store, checked=False)
    except StickslipError:  # the requested error of frequencies takes too many modes
        return None


def _more(part: Part) -> Part:
    """Return a part with more modes, the same object for every model that contains it.

    If a part keeps all modes, it is returned unchanged.
    """
    reduction: Any = part.reduction
    if part.body is not None or not isinstance(reduction, Reduction):
        return part
    modes = _choice(reduction.n_modes)
    if isinstance(reduction.n_modes, int) and reduction.n_modes >= part.structure.n:
        return part
    if REMEMBERED_AS not in part.memo:
        template = None if part.template is None else _more(part.template)
        made = replace(part, reduction=replace(reduction, n_modes=modes), template=template)
        part.memo[REMEMBERED_AS] = made
    found: Part = part.memo[REMEMBERED_AS]
    return found


def _choice(modes: ModeChoice) -> ModeChoice:
    if isinstance(modes, FrequencyError):
        return replace(modes, error=modes.error / FINER)
    if isinstance(modes, ModesBelow):
        return replace(modes, factor=MORE * modes.factor)
    return max(ceil(MORE * modes), modes + 1)
