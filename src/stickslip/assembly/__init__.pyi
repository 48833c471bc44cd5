"""Public names of `stickslip.assembly`, written once."""

from .assembled import Assembled as Assembled
from .assembled import ContactTable as ContactTable
from .assembled import Frequencies as Frequencies
from .assembled import Skin as Skin
from .contact import Contact as Contact
from .contact import Join as Join
from .load import Load as Load
from .load import Output as Output
from .model import Model as Model
from .placing import copy_of as copy_of
from .placing import place_of as place_of
