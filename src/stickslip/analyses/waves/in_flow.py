"""Flutter of a wave: for [flutter], and for [modes] beside natural frequencies."""

from stickslip.assembly.build import flow_around, holding_points
from stickslip.assembly.model import ContactsAs, Model
from stickslip.assembly.sides.waves import damping_by_modes
from stickslip.model.damping import Damping
from stickslip.response.rotating.flutter import FlutterOfWave, flutter_of_wave


def wave_in_flow(
    model: Model, contacts: ContactsAs, speed: float, wave_number: int, n_modes: int
) -> FlutterOfWave | None:
    """Return the modes of a wave with the aerodynamic forces of the model; None where it has none.

    Parameters
    ----------
    model, contacts
        The model and what its contacts do.
    speed
        In rad/s.
    wave_number
        Of the wave.
    n_modes
        Number of modes.
    """
    flow = flow_around(model, speed=speed)
    if flow is None:
        return None
    moving = model.at(speed, wave_number, holding_points(model, contacts), with_damping=True)
    parts = {k: p for k, p in model.parts.items() if p.body is None}
    reduced = any(part.reduction is not None for part in parts.values())
    damping = damping_by_modes(parts, reduced=reduced)
    ratios: float | tuple[float, ...] = 0.0
    if isinstance(damping, Damping):
        ratios = damping.modal or 0.0
    elif damping is not None:
        moving = damping.of_modes(moving)
    feedback = flow.on_structure(wave_number, moving)
    return flutter_of_wave(moving, feedback, n_modes, ratios=ratios)
