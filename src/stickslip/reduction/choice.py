"""The reduction of a part: method and number of modes."""

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

from stickslip.arrays import IntArray
from stickslip.errors import SingularError, input_error
from stickslip.model.structure import Structure
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.free_interface import rubin
from stickslip.reduction.truncation import FrequencyError, ModeChoice

Method = Literal["craig_bampton", "rubin"]


class _Reduces(Protocol):
    def __call__(self, structure: Structure, keep: IntArray, n_modes: ModeChoice) -> Structure: ...


METHODS: dict[str, _Reduces] = {"craig_bampton": craig_bampton, "rubin": rubin}  # type: ignore[dict-item]


@dataclass(frozen=True)
class Reduction:
    """A method of reduction with its number of modes.

    Parameters
    ----------
    n_modes
        Modes kept in addition to the static shapes: a number (all modes if there are fewer), `ModesBelow` a frequency, or, with
        Craig-Bampton, a `FrequencyError`.
    method
        ``craig_bampton``: modes with the kept dofs fixed; ``rubin``: modes with them free, rigid motions among them.

    Raises
    ------
    InputError
        If the method is unknown, or gives no error estimate but `n_modes` asks for one.
    """

    n_modes: ModeChoice = 25
    method: Method = "craig_bampton"

    def __post_init__(self) -> None:
        if self.method not in get_args(Method):
            known = " or ".join(METHODS)
            raise input_error("Reduction.method", f"is {self.method!r}", f"Give {known}.")
        if self.method == "rubin" and isinstance(self.n_modes, FrequencyError):
            raise input_error(
                "Reduction.n_modes",
                "is an error of frequencies, and modes that rubin keeps are exact",
                "Give a number of modes, or ModesBelow a frequency.",
            )

    def of(self, structure: Structure, keep: IntArray) -> Structure:
        """Return a structure reduced to the dofs `keep` and its modes; see `craig_bampton` and `rubin`."""
        n_modes, most = self.n_modes, structure.n - len(keep)
        if isinstance(n_modes, int):
            n_modes = min(n_modes, most)
        try:
            return METHODS[self.method](structure, keep, n_modes)
        except SingularError:
            if n_modes != most or self.method != "rubin":
                raise
            # all modes are requested, so Craig-Bampton spans the same space, and it needs no residual flexibility
            return craig_bampton(structure, keep, n_modes)

    @property
    def in_words(self) -> str:
        """Method and number of modes as text, for a line about the part."""
        modes = f"{self.n_modes} modes" if isinstance(self.n_modes, int) else repr(self.n_modes)
        return f"{self.method}, {modes}"
