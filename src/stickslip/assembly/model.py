"""Parts, contacts and loads: a model. It does not know who asks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.load import Load, Output
from stickslip.model.part import Part

ContactsAs = Literal["static", "stuck", "open"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Model:
    """Any number of parts, the contacts between their surfaces, and the loads on them.

    Parameters
    ----------
    parts, contacts, joins, loads
        By name.
    outputs
        Where motion is reported; the first label decides the peak unless `peak_output` names another.
    peak_output
        Label ``name.direction`` of the output whose peak is resolved; empty: the first one.
    alert_over
        Labels over which the error of missing harmonics is taken; empty: the outputs along the excitation.
    speed
        Of rotation, rad/s.
    tangent, coriolis
        As in `RotatingSolid.at_speed`.
    centrifugal
        Whether the centrifugal load of rotating parts is a static load of the response.
    retention
        Stiffness that holds the mean position of free rigid bodies, N/m.
    """

    parts: Mapping[str, Part]
    contacts: Mapping[str, Contact] = field(default_factory=dict)
    joins: Mapping[str, Join] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    outputs: tuple[Output, ...] = ()
    peak_output: str = ""
    alert_over: tuple[str, ...] = ()
    speed: float = 0.0
    tangent: Literal["consistent", "textbook"] = "consistent"
    coriolis: bool = False
    centrifugal: bool = True
    retention: float = 0.0
