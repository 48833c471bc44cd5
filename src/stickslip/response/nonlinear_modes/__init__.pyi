"""Public names of `stickslip.response.nonlinear_modes`, written once."""

from .backbone import Backbone as Backbone
from .backbone import ModePoint as ModePoint
from .backbone import ModeSweep as ModeSweep
from .backbone import nonlinear_mode as nonlinear_mode
from .oscillator import ModalOscillator as ModalOscillator
from .oscillator import modal_oscillator as modal_oscillator
from .passage import Passage as Passage
from .passage import Swept as Swept
from .passage import passage_through_resonance as passage_through_resonance
from .synthesis import Resonance as Resonance
from .synthesis import Synthesised as Synthesised
from .synthesis import free_motions as free_motions
from .synthesis import motions_at as motions_at
from .synthesis import resonances as resonances
from .synthesis import synthesise as synthesise
