"""Contact laws, one per file, and their registry."""

from collections.abc import Iterator, Mapping
from importlib import import_module


class _Registry(Mapping[str, type]):
    """Law classes by name; a module is imported, and its step compiled, when its law is first used."""

    def __init__(self, classes: dict[str, str]) -> None:
        self._classes = classes

    def __getitem__(self, name: str) -> type:
        law: type = getattr(import_module(f"{__name__}.{name}"), self._classes[name])
        return law

    def __iter__(self) -> Iterator[str]:
        return iter(self._classes)

    def __len__(self) -> int:
        return len(self._classes)


# file → class of laws whose force is a function of the gap
_OF_THE_GAP = {
    "bonded": "Bonded",
    "unilateral_spring": "UnilateralSpring",
    "cubic_spring": "CubicSpring",
    "polynomial_spring": "PolynomialSpring",
    "jenkins": "Jenkins",
    "elastic_coulomb": "ElasticCoulomb",
    "coupled_coulomb": "CoupledCoulomb",
    "regularised_coulomb": "RegularisedCoulomb",
    "dahl": "Dahl",
    "bouc_wen": "BoucWen",
    "iwan": "Iwan",
}
LAWS: Mapping[str, type] = _Registry(_OF_THE_GAP)
# all laws of study files, including the rigid one, whose force is not a function of the gap (`harmonic.dlft`)
ALL_LAWS: Mapping[str, type] = _Registry(_OF_THE_GAP | {"rigid_coulomb": "RigidCoulomb"})


def law_name(law: object) -> str:
    """Return the name of a law in study files; for a user's law, the name of its class."""
    return type(law).__name__ if is_of_a_user(law) else type(law).__module__.rpartition(".")[2]


def is_of_a_user(law: object) -> bool:
    """Whether a law is none of the laws of study files."""
    package, _, name = type(law).__module__.rpartition(".")
    return package != __name__ or name not in ALL_LAWS
