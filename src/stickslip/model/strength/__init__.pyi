"""Public names of `stickslip.model.strength`, written once."""

from .card import StrengthCard as StrengthCard
from .cycle import alternating_and_mean as alternating_and_mean
from .cycle import history as history
from .cycle import von_mises as von_mises
from .haigh import HaighTable as HaighTable
from .haigh import Hardening as Hardening
from .haigh import Margin as Margin
from .haigh import allowable_amplitude as allowable_amplitude
from .haigh import cycles as cycles
from .haigh import five_segment_table as five_segment_table
from .haigh import fkm_goodman_table as fkm_goodman_table
from .haigh import margin as margin
