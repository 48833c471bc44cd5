"""Public names of `stickslip.response.self_excited`, written once."""

from .curve import AmplitudePoint as AmplitudePoint
from .curve import damping_over_amplitude as damping_over_amplitude
from .curve import parameter_over_amplitude as parameter_over_amplitude
from .curve import slip_amplitude as slip_amplitude
from .cycles import CycleStability as CycleStability
from .cycles import LimitCycle as LimitCycle
from .cycles import cycle_stability as cycle_stability
from .cycles import limit_cycles as limit_cycles
from .in_time import WaveHistory as WaveHistory
from .in_time import march_periods as march_periods
from .in_time import wave_history as wave_history
from .modes import StuckMode as StuckMode
from .modes import stuck_modes as stuck_modes
from .problem import SelfExcited as SelfExcited
from .problem import self_excited_motions as self_excited_motions
