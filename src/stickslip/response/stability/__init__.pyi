"""Public names of `stickslip.response.stability`, written once."""

from .found import Stability as Stability
from .hill_method.hill import HillStability as HillStability
from .hill_method.hill import hill_exponents as hill_exponents
from .hill_method.hill import hill_stability as hill_stability
from .multipliers import motion_stability as motion_stability
from .multipliers import settled_stability as settled_stability
from .multipliers import stability as stability
from .waves import WaveDisturbance as WaveDisturbance
from .waves import point_disturbances as point_disturbances
from .waves import wave_disturbances as wave_disturbances
