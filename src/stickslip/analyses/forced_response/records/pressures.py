"""Pressure fields in words: force and moment before and after the mapping, and modal forces."""

from collections.abc import Mapping

import numpy as np

from stickslip.analyses.waves.records import label
from stickslip.arrays import ComplexArray
from stickslip.assembly.build import holding_points
from stickslip.assembly.fluid.aero_forces import own_dofs, phases
from stickslip.assembly.forces import Load, force_of
from stickslip.assembly.model import Model
from stickslip.model.modes import normal_modes
from stickslip.reduction.waves import excited_wave
from stickslip.units import millimetres

ROUNDING = 1e-12  # m
MODES = 3  # modes with a reported modal force, unless the study sets their number


def pressure_lines(model: Model, modes: Mapping[str, int]) -> tuple[str, ...]:
    """Return sentences about the pressure fields of a model, with the modal forces of `modes` modes for each load."""
    found: list[str] = []
    for name, load in model.loads.items():
        if load.field is not None:
            found += _about(model, name, load, modes.get(name, MODES))
    return tuple(found)


def _about(model: Model, name: str, load: Load, count: int) -> list[str]:
    assert load.field is not None
    put = load.field.on(model.places, load.on, f"load.{name}.on")
    (force, moment), (own_force, own_moment) = put.before, put.after
    offset = f"; points up to {millimetres(put.offset if put.offset > ROUNDING else 0.0, 3)} off it"
    if put.inward:
        offset += ", their normals point into the body"
    if np.any(put.clamped):
        offset += f"; {_vector(put.clamped)} N act on clamped nodes"
    sums = (
        f"load.{name}: pressure on {load.on}: force {_vector(force)} N, on its nodes {_vector(own_force)} N; moment about the origin "
        f"{_vector(moment)} N m, on its nodes {_vector(own_moment)} N m{offset}"
    )
    if not load.harmonic or not count:
        return [sums]
    number = excited_wave((load.engine_order or 0) * load.harmonic, model.sectors)
    moving = model.at(model.speed, number, holding_points(model, "static"))
    shapes = normal_modes(moving, count)
    turned = np.asarray(moving.expand(shapes.shapes))
    turned = turned * phases(turned, own_dofs(model))
    modal = turned.conj().T @ force_of(model.places, name, load)
    wave = label(number, model.sectors, parted=True)
    told = ", ".join(
        f"{hz:.6g} Hz: {abs(q):.4g} at {np.degrees(np.angle(q)):.1f} deg"
        for hz, q in zip(shapes.frequencies_hz, modal, strict=True)
    )
    return [sums, f"load.{name}: modal forces in N/sqrt(kg) on {wave}, contacts static: {told}"]


def _vector(values: ComplexArray) -> str:
    """Write three complex numbers as amplitude and phase, real ones as they are."""
    if not np.any(values.imag):
        return f"({', '.join(f'{v:.5g}' for v in values.real)})"
    size = np.abs(values).max()
    told = [f"{abs(v):.5g} at {np.degrees(np.angle(v)) if abs(v) > 1e-9 * size else 0:.1f} deg" for v in values]
    return f"({', '.join(told)})"
