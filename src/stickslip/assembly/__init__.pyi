"""Public names of `stickslip.assembly`, written once."""

from .assembled import Assembled as Assembled
from .assembled import Blades as Blades
from .assembled import ContactTable as ContactTable
from .assembled import Frequencies as Frequencies
from .assembled import Skin as Skin
from .assembling import assemble as assemble
from .fluid.aerodynamics import Aerodynamics as Aerodynamics
from .fluid.pressure import PressureField as PressureField
from .model import Model as Model
from .part_copies import copy_of as copy_of
from .part_copies import place_of as place_of
from .sides.mistuning import BladeMistuning as BladeMistuning
from .sides.mistuning import ContactMistuning as ContactMistuning
from .sides.mistuning import Mistuning as Mistuning
from .sides.mistuning import OwnSector as OwnSector
from .sides.mistuning import pattern as pattern
