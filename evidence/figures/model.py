"""The two cases of the figures: study files, what is changed in them, and what is computed. They are put in here and nowhere else."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from evidence.models.two_blades import SHIPPED, TwoBlades, two_blades
from stickslip import ElasticCoulomb, HarmonicLoad, Sweep, System
from stickslip.arrays import IntArray
from stickslip.response import frozen_sliders

SHARES = (0.9, 0.7, 0.5, 0.3)  # of the friction, with which the static state may be found before sliders are frozen


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is computed of a case. Ratios are F_CL/F_HE, frequencies Hz.

    Attributes
    ----------
    ratios
        Of the errors (fig. 6, 7a), largest first.
    weak, strong, strongest
        Three of them: the paper's weak case, and both readings of its strong one (fig. 6b).
    time_ratios
        Where five harmonics are held against time, lowest first: the first one whose peak is periodic is taken (fig. 4, 5).
    all_ratios, timing_ratios
        Of the optimisation curves (fig. 9) and of the costs (fig. 7b), largest first.
    branch_hertz
        Range of responses that are followed along their branch, and in which their peak is looked for: below the next mode.
    hertz, frequencies
        Equally spaced frequencies of the errors.
    timing_hertz, timing_frequencies, repeats
        Those of the costs, and how often each response is computed for its time.
    markers, marker_hertz
        Number of time integrations beside a peak, and their range from below to above it.
    """

    ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 7.0, 5.0, 2.0)
    weak: float = 20.0
    strong: float = 5.0
    strongest: float = 2.0
    time_ratios: tuple[float, ...] = (2.0, 3.0, 5.0)
    all_ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 5.0, 3.0, 2.0)
    timing_ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 5.0, 3.0)
    branch_hertz: tuple[float, float] = (150.0, 187.0)
    hertz: tuple[float, float] = (150.0, 190.0)
    frequencies: int = 81
    timing_hertz: tuple[float, float] = (163.25, 187.0)
    timing_frequencies: int = 20
    repeats: int = 5
    markers: int = 7
    marker_hertz: tuple[float, float] = (-4.0, 2.0)


@dataclass(frozen=True, kw_only=True)
class SecondPlan:
    """What is computed of the second damper.

    Attributes
    ----------
    mode
        Name of the blades' mode in the range, as the page has it.
    ratios
        Of fig. 10, largest first; the last is that of fig. 11.
    all_ratios
        Of the optimisation curves (fig. 9), largest first: from full stick to below what the paper's rig could impose.
    hertz, frequencies
        Range of the responses, and number of equally spaced frequencies of the errors in it.
    """

    mode: str = "second bending"
    ratios: tuple[float, float] = (23.4, 11.7)
    all_ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 30.0, 23.4, 11.7, 5.0, 3.0)
    hertz: tuple[float, float] = (480.0, 650.0)
    frequencies: int = 69

    @property
    def named(self) -> tuple[float, ...]:
        """Every ratio, largest first."""
        return tuple(sorted({*self.all_ratios, *self.ratios}, reverse=True))


@dataclass(frozen=True)
class Case:
    """A study and what is changed in it.

    Attributes
    ----------
    study
        Its file, of the same parts, points and loads as the example's.
    changed
        Values of other keys, lists as tuples; harmonics are set to the published 1 and 5 anyway.
    """

    study: Path = SHIPPED
    changed: Mapping[str, object] = field(default_factory=dict)

    def said(self) -> str:
        """Return the study and its changes as the page shows them."""
        where = "/".join(self.study.parts[-3:])
        keys = ", ".join(
            f"`{key} = {list(value) if isinstance(value, tuple) else value}`" for key, value in self.changed.items()
        )
        return f"`{where}`" + (f" with {keys}" if keys else "")


# ---------------------------------------------------------------- the two cases: exchange them here
# of figures 1 and 4 to 7: the example (docs/reconstruction.md)
FIRST = Case(SHIPPED)
FIRST_PLAN = Plan()
# of figures 9 to 11: the damper whose flat side never slips (docs/second_damper.md)
SECOND = Case(SHIPPED.parents[1] / "second_bending" / "study.toml")
SECOND_PLAN = SecondPlan()
# -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Model:
    """What the figures need of a system.

    Attributes
    ----------
    system, sweep
        The system, and how its study sweeps.
    load
        Loads for a ratio F_CL/F_HE.
    rotation
        Dof of the damper's rotation about the axial direction.
    contact_dofs
        Dofs of the blades at the contact points, along the excitation.
    flat
        Contacts of the flat side.
    """

    system: System
    sweep: Sweep
    load: Callable[[float], HarmonicLoad]
    rotation: int
    contact_dofs: IntArray
    flat: IntArray

    @property
    def lines(self) -> tuple[str, ...]:
        """Line of each contact point: the part of its name before the point."""
        return tuple(name.split(".")[0] for name in self.system.interface.names)

    def frozen(self, share: float) -> "Model":
        """Return the same with sliders that start from the static state with a share of the friction, and from nothing else."""
        own = self.system.interface
        laws = tuple(
            replace(law, residual_traction=None, slider=None) if isinstance(law, ElasticCoulomb) else law
            for law in own.laws
        )
        plain = replace(self.system, interface=replace(own, laws=laws))
        return replace(self, system=frozen_sliders(plain, self.load(1.0).static, share))


def model(case: Case) -> Model:
    """Mesh and reduce a case."""
    own: TwoBlades = two_blades(path=case.study, **case.changed)
    return Model(own.system, own.sweep, own.load, own.rotation, own.contact_dofs, own.flat)
