"""Signatures of the functions that are called by address: what follows slip, and the rows along it."""

from typing import Any

from numba import types

from stickslip.contact.planar.motion import Motion
from stickslip.contact.planar.sensitivities import Rows
from stickslip.contact.planar.slip import Piece
from stickslip.contact.planar.trajectory import Course

_line = types.float64[::1]
_plane = types.float64[:, ::1]
_whole = types.int64[::1]
_named: Any = types.NamedTuple
_motion = _named((_plane, _line), Motion)
_piece = _named((_plane, _line, _line, _plane, _whole, _line, _line), Piece)
_course = _named((_motion, _piece, _line, _line, _plane, _plane, _plane, _whole), Course)
_rows = _named(
    (_plane, _line, _plane, _plane, _plane, _whole, _line, *(_plane,) * 6, types.float64[:, :, ::1], _plane), Rows
)
RUN = types.void(_course, types.float64, types.float64, types.int64)
FOLLOW_ROWS = types.void(_course, types.float64, types.float64, _rows, types.boolean)
