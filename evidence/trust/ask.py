"""The same machines as models of stickslip, and what it says of each point."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import stickslip as ss
from evidence.trust.draw import Contact, Machine
from stickslip.model.structure import Dofs, Structure


@dataclass(frozen=True)
class Told:
    """What is told of the points of a response: level (0 trusted, 1 doubtful, 2 wrong), stability in a word, motion (points, H+1, n)."""

    hz: npt.NDArray[np.float64]
    solved: npt.NDArray[np.bool_]
    level: npt.NDArray[np.int64]
    stability: tuple[str, ...]
    motion: npt.NDArray[np.complex128]
    peak: int
    peak_level: int
    reasons: tuple[str, ...]


def model_of(machine: Machine) -> "ss.Model":
    """Return a machine as a model; every dof is an output, and the output of the peak is the dof that is driven most."""
    dofs = Dofs(np.array(machine.nodes), machine.components, np.zeros((len(machine.nodes), 3)))
    part = ss.Part(structure=Structure(machine.mass, machine.damping, machine.stiffness, dofs))
    names = [f"p.node{n}.{c}" for n, c in zip(machine.nodes, machine.components, strict=True)]
    loads = {}
    for i, name in enumerate(names):
        if machine.force[i]:
            loads[f"f{i}"] = ss.Load(
                on=name,
                newton=float(abs(machine.force[i])),
                harmonic=machine.harmonic,
                phase=float(np.angle(machine.force[i])),
            )
        if machine.static[i]:
            loads[f"s{i}"] = ss.Load(on=name, newton=float(machine.static[i]), harmonic=0)
    return ss.Model(
        parts={"p": part},
        contacts={f"c{i}": _contact(c, names, machine) for i, c in enumerate(machine.contacts)},
        loads=loads,
        outputs=tuple(ss.Output(name=f"o{i}", on=name) for i, name in enumerate(names)),
    )


def _contact(c: Contact, names: list[str], machine: Machine) -> "ss.Contact":
    own, other = c.between
    if c.kind == "pad":
        law: Any = ss.ElasticCoulomb(
            k_t=c.stiffness, k_w=c.stiffness, k_n=c.normal_stiffness, mu=c.friction, preload=c.preload
        )
        return ss.Contact(
            between=(f"p.node{own + 1}", "ground"), law=law, normal=(0.0, 0.0, 1.0), tangent=(1.0, 0.0, 0.0)
        )
    second = "ground" if other < 0 else names[other]
    if c.kind == "stop":
        law = ss.UnilateralSpring(k_n=c.stiffness, initial_gap=c.clearance)
        return ss.Contact(between=(names[own], second), law=law, acts="normal")
    law = ss.CubicSpring(cubic_t=c.stiffness) if c.kind == "cubic" else ss.Jenkins(k_t=c.stiffness, limit=c.limit)
    return ss.Contact(between=(names[own], second), law=law, acts="tangential")


def asked(machine: Machine, **keys: Any) -> Told:
    """Return what the default response of a machine says."""
    data = model_of(machine).forced_response(hz=machine.hz, **keys)["forced_response"]
    parts = data.output_displacement.values
    hz = data.frequency_hz.values
    return Told(
        hz,
        data.status.values == 0,
        data.verdict.values,
        _stability(data),
        parts[..., 0] + 1j * parts[..., 1],
        int(data.peak_point.values[0]),
        int(data.case_verdict.values[0]),
        tuple(str(t) for t in data.verdict_reason.values),
    )


def _stability(data: Any) -> tuple[str, ...]:
    if "motion_stability_basis" in data:
        words = str(data.motion_stability.attrs["flag_meanings"]).replace("_", " ")
        names = ["stable", "unstable", "undecided", "not examined", "neutral"]
        assert words == " ".join(names)
        own = zip(data.motion_stability.values, data.motion_stability_basis.values, strict=True)
        return tuple("carried" if names[w] == "stable" and b == 2 else names[w] for w, b in own)
    told = dict.fromkeys(np.round(data.frequency_hz.values, 9).tolist(), "not examined")
    if "stability_verdict" in data:
        for hz, word in zip(data.stability_frequency_hz.values, data.stability_verdict.values, strict=True):
            told[round(float(hz), 9)] = str(word)
    return tuple(told[round(float(hz), 9)] for hz in data.frequency_hz.values)
