"""A model as solvers see it: a single structure, a tuned wheel, or a wheel whose sectors differ."""

from stickslip.assembly.assembled import Assembled
from stickslip.assembly.build import assemble_tuned
from stickslip.assembly.load import refuse_second
from stickslip.assembly.model import Model
from stickslip.assembly.parts.reduced import Store, in_memory
from stickslip.assembly.sides.mistuned import assemble_mistuned


def assemble(
    model: Model, harmonics: int, store: Store = in_memory, *, wave_number: int | None = None, every_wave: bool = False
) -> Assembled:
    """Reduce the parts of a model, join them, pair the contacts, and place all under the static loads.

    Parameters
    ----------
    model
        The model.
    harmonics
        Highest harmonic of the response.
    store
        Takes a text that all depends on and a function that makes named arrays; returns these, perhaps from an earlier run.
    wave_number
        Of a wheel: that in which a motion travels that nothing drives; harmonic loads are then left out. None: the loads say.
    every_wave
        Whether all waves of a wheel are reduced, as its stability against every one of them needs.

    Raises
    ------
    InputError
        If something of the model does not fit; the message names it.
    SingularError
        If nothing holds a body, or the static loads find no equilibrium.
    """
    if wave_number is not None:
        model = model.undriven
    refuse_second(model.loads)
    if model.mistuning is not None:
        return assemble_mistuned(model, harmonics, store)
    return assemble_tuned(model, harmonics, store, wave_number, every_wave=every_wave)
