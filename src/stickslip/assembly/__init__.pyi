"""Public names of `stickslip.assembly`, written once."""

from .aerodynamics import Aerodynamics as Aerodynamics
from .assembled import Assembled as Assembled
from .assembled import Blades as Blades
from .assembled import ContactTable as ContactTable
from .assembled import Frequencies as Frequencies
from .assembled import Skin as Skin
from .assembling import assemble as assemble
from .mistuning import BladeMistuning as BladeMistuning
from .mistuning import ContactMistuning as ContactMistuning
from .mistuning import Mistuning as Mistuning
from .mistuning import OwnSector as OwnSector
from .mistuning import pattern as pattern
from .model import Model as Model
from .part_copies import copy_of as copy_of
from .part_copies import place_of as place_of
from .pressure import PressureField as PressureField
