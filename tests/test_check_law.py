"""What `check_law` says of right and of wrong laws."""

import re
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import stickslip as ss
from stickslip.analyses.forced_response.physics.limits import _rubs_by_normal_force
from stickslip.contact.law import law_kernel
from stickslip.contact.law_check import check_law
from stickslip.contact.laws import LAWS
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError

RIGHT = {
    "bonded": (ss.Bonded(k_t=2e6, k_w=1e6, k_n=3e6), 1e-5),
    "unilateral_spring": (ss.UnilateralSpring(k_n=3e6, initial_gap=5e-6), 1e-5),
    "cubic_spring": (ss.CubicSpring(cubic_t=3.0, k_n=1.0, cubic_n=-0.02), 1.0),
    "polynomial_spring": (ss.PolynomialSpring(along_t=(1.0, 0.2), along_n=(-1.0, 0.0, 2.0)), 1.0),
    "jenkins": (ss.Jenkins(k_t=2e6, k_w=1e6, k_n=3e6, limit=10.0), 1e-5),
    "elastic_coulomb": (ss.ElasticCoulomb(k_t=2e6, k_w=1e6, k_n=3e6, mu=0.4, preload=10.0), 1e-5),
    "coupled_coulomb": (ss.CoupledCoulomb(k_t=2e6, k_n=3e6, mu=0.4, preload=10.0), 1e-5),
    "regularised_coulomb": (ss.RegularisedCoulomb(mu=0.4, transition_velocity=0.5, k_n=3.0, preload=0.3), 1.0),
    "dahl": (ss.Dahl(k_t=2.0, k_w=1.5, k_n=1.0, limit=0.4), 1.0),
    "bouc_wen": (ss.BoucWen(k_t=2.0, beta=0.5, gamma=0.2, alpha=0.1, a=0.7, k_n=1.0), 1.0),
    "iwan": (ss.Iwan(k_t=2.0, limit=1.0), 1.0),
}


def test_every_law_is_among_them():
    assert list(RIGHT) == list(LAWS)


@pytest.mark.parametrize(("law", "size"), RIGHT.values(), ids=RIGHT)
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

    def stuck_stiffness(self):
        return np.zeros(3)


class _PressedLaw(_Law):
    def stuck_stiffness(self):
        return np.array([1.0, 0.0, 2.0])


class _Own(ElasticCoulomb):
    """Its normal stiffness is told in its parameters or in `stuck_stiffness` alone."""

    sign: ClassVar[float] = 1.0
    stuck: ClassVar[tuple[float, ...]] = (2e6, 1e6, 3e6)

    def parameters(self):
        return super().parameters() * np.array([1.0, 1.0, self.sign, 1.0, 1.0, 1.0, 1.0])

    def stuck_stiffness(self):
        return np.array(self.stuck)


class _Parting(_Own):
    sign = -1.0


class _PartingAsTold(_Parting):
    stuck = (2e6, 1e6, -3e6)


class _Stiffer(_Own):
    stuck = (9e9, 0.0, 1.0)


class _NoNormal(_Own):
    stuck = (2e6, 1e6, 1.0)


def test_wrong_laws_are_told_where():
    with pytest.raises(InputError, match=r"_Forgetful: the step does not fill force\[1\]"):
        check_law(_Forgetful())
    with pytest.raises(InputError, match=r"_Wrong: jac\[0, 0\], force\[0\] by displacement\[0\], is 1,"):
        check_law(_Wrong())
    with pytest.raises(InputError, match=r"pairs = 5 leaves out jac\[0, 1\]"):
        check_law(_Coupled(n_state=1))
    check_law(_Coupled(pairs=7, n_state=1))
    with pytest.raises(InputError, match="pairs is 3"):
        check_law(_Coupled(pairs=3, n_state=1))


def test_a_law_without_a_member_is_told_so():
    @dataclass(frozen=True)
    class Half:
        pairs: int = 5

    with pytest.raises(InputError, match=r"is a Half, which has no .*stuck_stiffness"):
        check_law(Half())  # type: ignore[arg-type]


def test_a_run_doubts_a_law_of_ones_own_that_is_inconsistent():
    body = ss.model.lumped(np.eye(1), 0.02 * np.eye(1), np.eye(1), names=("a",))
    model = ss.Model(
        parts={"p": ss.Part(structure=body)},
        contacts={"c": ss.Contact(between=("p.a", "ground"), law=_Wrong(), acts="tangential")},
        loads={"f": ss.Load(on="p.a", newton=0.01)},
        outputs=(ss.Output(name="a", on="p.a"),),
    )
    found = model.forced_response(hz=(0.1, 0.3), points=6, high=3, stability="off")
    (told,) = [v.why for v in found.verdicts if "inconsistent" in v.why]
    assert "the law _Wrong is inconsistent: jac[0, 0], force[0] by displacement[0], is 1," in told
    assert found.conclusion.startswith("Not to be trusted")


@pytest.mark.parametrize(
    ("law", "follows"),
    [
        (ElasticCoulomb(k_t=2e6, k_w=1e6, k_n=3e6, mu=0.4, preload=10.0), True),
        (ss.Jenkins(k_t=2.0, limit=1.0, k_n=1.0), False),  # its limit is a force of its own
        (_Own(k_t=2e6, k_w=1e6, k_n=3e6, mu=0.4), True),
        (_Wrong(), False),
        (_PressedLaw(), True),
    ],
    ids=lambda x: type(x).__name__ if not isinstance(x, bool) else "",
)
def test_the_friction_of_a_law_with_a_normal_stiffness_may_follow_the_normal_force(law, follows):
    assert _rubs_by_normal_force(law) == follows


@pytest.mark.parametrize("preload", [10.0, -5.0])
def test_a_pressure_that_grows_as_the_bodies_part_is_told_with_numbers(preload):
    numbers = {"k_t": 2e6, "k_w": 1e6, "k_n": 3e6, "mu": 0.4, "preload": preload}
    check_law(_Own(**numbers), size=1e-5)
    for wrong in (_Parting, _PartingAsTold):
        with pytest.raises(InputError, match="the pressure grows as the bodies part") as error:
            check_law(wrong(**numbers), size=1e-5)
        told = re.findall(r"(\S+) N at (?:a normal gap of )?(\S+) m", str(error.value))
        (first, near), (second, apart) = ((float(n), float(g)) for n, g in told)
        assert (second - first) / (apart - near) == pytest.approx(3e6, rel=1e-2)  # printed to 1e-6


def test_a_stuck_stiffness_that_the_law_has_nowhere_is_told():
    numbers = {"k_t": 2e6, "k_w": 1e6, "k_n": 3e6, "mu": 0.4, "preload": 10.0}
    with pytest.raises(InputError, match=r"stuck_stiffness\[0\] is 9e\+09 N/m, .* is 2e\+06 N/m where"):
        check_law(_Stiffer(**numbers), size=1e-5)
    with pytest.raises(InputError, match=r"stuck_stiffness\[2\] is 1 N/m, .* is 3e\+06 N/m where"):
        check_law(_NoNormal(**numbers), size=1e-5)
