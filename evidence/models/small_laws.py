"""Three coupled coordinates, shaken along all of them, on one contact of each law that the judge in time knows."""

import numpy as np

from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.system import System

LAWS: dict[str, ContactLaw] = {
    "two springs, lift-off": ElasticCoulomb(k_t=2.0, k_w=1.0, k_n=1.5, mu=0.4, preload=0.2),
    "planar": CoupledCoulomb(k_t=2.0, k_n=1.5, mu=0.4, preload=1.0),
    "planar, lift-off": CoupledCoulomb(k_t=2.0, k_n=1.5, mu=0.4, preload=0.2),
    "planar, anisotropic": CoupledCoulomb(k_t=2.0, k_w=0.8, k_n=1.5, mu=0.4, preload=1.0),
    "Iwan": Iwan(k_t=2.0, k_w=1.0, limit=0.3),
    "Bouc-Wen": BoucWen(k_t=1.0, k_w=0.7, beta=1.0, gamma=0.5, alpha=0.1, exponent=1.5),
    "Dahl": Dahl(k_t=1.0, k_w=1.0, limit=0.3),
    "cubic springs": CubicSpring(cubic_t=0.5, cubic_w=0.3, cubic_n=0.2, k_t=0.1, k_w=0.1, k_n=0.1),
}
OMEGA = 0.9  # rad/s


def on_one_contact(law: ContactLaw) -> tuple[System, HarmonicLoad]:
    """Return the system and its load."""
    stiffness = np.array([[1.1, -0.1, 0.0], [-0.1, 1.4, -0.1], [0.0, -0.1, 2.1]])
    dofs = Dofs(np.arange(3), ("x",) * 3, np.zeros((3, 3)))
    structure = Structure(np.eye(3), 0.05 * stiffness, stiffness, dofs)
    load = HarmonicLoad(np.zeros(3), {1: np.array([1.0, 0.8j, 0.9 * np.exp(0.7j)])})
    return System(structure, Interface(("c",), (law,), np.eye(3)), np.arange(3)), load
