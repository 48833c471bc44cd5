"""Public names of `stickslip.assembly`, written once."""

from .assembled import Assembled as Assembled
from .assembled import ContactTable as ContactTable
from .assembled import Frequencies as Frequencies
from .assembled import Skin as Skin
