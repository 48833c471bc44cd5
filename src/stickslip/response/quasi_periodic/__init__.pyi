"""Public names of `stickslip.response.quasi_periodic`, written once."""

from .in_time import course as course
from .in_time import statistics as statistics
from .problem import TorusMotion as TorusMotion
from .problem import TwoTones as TwoTones
from .problem import envelope as envelope
from .problem import two_tones as two_tones
from .problem import with_enough as with_enough
from .tone import beginnings as beginnings
from .tone import forced_motion as forced_motion
from .tone import over_amplitude as over_amplitude
from .tone import second_tone as second_tone
from .tone import solve_free as solve_free
from .tone import tone_beside as tone_beside
