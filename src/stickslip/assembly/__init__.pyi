"""Public names of `stickslip.assembly`, written once."""

from .assembled import Assembled as Assembled
from .assembled import ContactTable as ContactTable
from .assembled import Frequencies as Frequencies
from .assembled import Skin as Skin
from .model import Model as Model
from .placing import copy_of as copy_of
from .placing import place_of as place_of
