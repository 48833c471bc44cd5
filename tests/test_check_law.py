"""What `check_law` says of right and of wrong laws."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from stickslip.contact.law import law_kernel
from stickslip.contact.law_check import check_law
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.errors import InputError


@pytest.mark.parametrize(
    ("law", "size"),
    [
        (ElasticCoulomb(k_t=2e6, k_w=1e6, k_n=3e6, mu=0.4, preload=10.0), 1e-5),
        (CoupledCoulomb(k_t=2e6, k_n=3e6, mu=0.4, preload=10.0), 1e-5),
        (Iwan(k_t=2.0, limit=1.0), 1.0),
        (CubicSpring(cubic_t=3.0), 1.0),
    ],
)
def test_right_laws_pass(law, size):
    check_law(law, size=size)


def _forgets(displacement, velocity, state, parameters, force, new_state, jac, status):
    force[0] = displacement[0] + parameters[0] * displacement[0] ** 3
    force[2] = 0.0
    jac[0, 0] = 1.0 + 3.0 * parameters[0] * displacement[0] ** 2
    status[:] = 0


def _wrong(displacement, velocity, state, parameters, force, new_state, jac, status):
    force[:] = 0.0
    force[0] = displacement[0] + parameters[0] * displacement[0] ** 3
    jac[0, 0] = 1.0
    status[:] = 0


def _coupled(displacement, velocity, state, parameters, force, new_state, jac, status):
    force[:] = 0.0
    force[0] = displacement[1] * displacement[1]
    new_state[0] = velocity[0] + parameters[0]
    jac[0, 1] = 2.0 * displacement[1]
    jac[3, 3] = 1.0
    status[:] = 0


@dataclass(frozen=True)
class _Law:
    kernel: ClassVar[Any]
    pairs: int = 5
    n_state: int = 0

    def parameters(self):
        return np.array([0.5])

    def initial_state(self):
        return np.zeros(self.n_state)

    def stuck_stiffness(self):
        return np.array([1.0, 0.0, 0.0])


class _Forgetful(_Law):
    kernel = law_kernel(_forgets)


class _Wrong(_Law):
    kernel = law_kernel(_wrong)


class _Coupled(_Law):
    kernel = law_kernel(_coupled)


def test_wrong_laws_are_told_where():
    with pytest.raises(InputError, match=r"_Forgetful: the step does not fill force\[1\]"):
        check_law(_Forgetful())
    with pytest.raises(
        InputError, match=r"_Wrong: jac\[0, 0\], force\[0\] by displacement\[0\], is 1,"
    ):
        check_law(_Wrong())
    with pytest.raises(InputError, match=r"pairs = 5 leaves out jac\[0, 1\]"):
        check_law(_Coupled(n_state=1))
    check_law(_Coupled(pairs=7, n_state=1))
    with pytest.raises(InputError, match="pairs is 3"):
        check_law(_Coupled(pairs=3, n_state=1))
