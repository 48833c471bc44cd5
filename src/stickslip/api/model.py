"""A model that answers questions itself, without any file."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from html import escape
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Unpack

import numpy as np
from pydantic import ValidationError

from stickslip.api.as_tables import as_tables
from stickslip.api.keys import (
    AllMotionsKeys,
    CampbellKeys,
    FlutterKeys,
    ForcedResponseKeys,
    LimitCycleKeys,
    ModalSynthesisKeys,
    ModesKeys,
    NonlinearModeKeys,
    QuasiPeriodicKeys,
    ResidualTractionsKeys,
    ResonanceKeys,
    RunUpKeys,
    SafeKeys,
)
from stickslip.api.result import Result, result_of
from stickslip.api.screen import by_default
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact
from stickslip.assembly.model import Model as Assembly
from stickslip.errors import input_error
from stickslip.model.blas_threads import one_loaded_blas_thread
from stickslip.model.part import Part
from stickslip.study.analysis import Case, named
from stickslip.study.file.messages import told
from stickslip.study.file.section import Section
from stickslip.study.file.suffixes import nearest_key
from stickslip.study.file.tables import Tables
from stickslip.study.questions import ANALYSES
from stickslip.study.run import answer
from stickslip.units import RPM

OF_THE_MODEL = ("alert_over",)  # keys of tables that are fields of a model


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Model(Assembly):
    """Parts, contacts and loads, and the questions that can be asked of them.

    Every key of a study's table is an argument of the method of that name, with the same meaning, unit and default.
    `forced_response` also takes the keys of [harmonics], [solver] and [limits]. Editors complete the keys, and type
    checkers compare them. A study gives the same numbers.
    """

    def assembled(self, harmonics: int, *, every_wave: bool = False) -> Assembled:
        """Return the assembled model, the input of the lower layers; see `assemble` of `stickslip.assembly`."""
        return assemble(self, harmonics, every_wave=every_wave, linear=True)

    def forced_response(
        self,
        hz: Iterable[float] | None = None,
        *,
        verify: bool = False,
        verify_harmonics: bool = False,
        folder: str | Path | None = None,
        **keys: Unpack[ForcedResponseKeys],
    ) -> Result:
        """Compute the steady vibration under the harmonic loads.

        Parameters
        ----------
        hz
            (lowest, highest) frequency in Hz; more than two values are a list of frequencies.
        verify, verify_harmonics
            Compare with time integration, and with twice as many harmonics.
        folder
            Folder for ``result.nc``; left out: the result stays in memory.
        keys
            Keys of the tables, such as ``low=1, high=5, points=60, selection="guarded_alert", direction="down"``.

        Raises
        ------
        InputError
            If a key is unknown, or the model does not allow the analysis.
        """
        given: dict[str, Any] = {**keys}
        if hz is not None:
            own = _frequencies(hz)
            given["frequency_hz" if len(own) == 2 else "frequencies_hz"] = own
        asked = {"verify": verify, "verify_harmonics": verify_harmonics}
        checks = frozenset(name for name, wanted in asked.items() if wanted)
        return self._answer("forced_response", given, folder, checks)

    def modes(self, *, folder: str | Path | None = None, **keys: Unpack[ModesKeys]) -> Result:
        """Find natural frequencies and mode shapes; keys such as ``number=6, contacts="stuck"``."""
        return self._answer("modes", keys, folder)

    def campbell(self, *, folder: str | Path | None = None, **keys: Unpack[CampbellKeys]) -> Result:
        """Follow frequencies over speed; keys such as ``speeds_rpm=(0, 9000), engine_orders=[4, 20]``."""
        return self._answer("campbell", keys, folder)

    def flutter(self, *, folder: str | Path | None = None, **keys: Unpack[FlutterKeys]) -> Result:
        """Find the aerodynamic damping of every wave; keys such as ``number=2, contacts="open"``. The model needs `aerodynamics`."""
        return self._answer("flutter", keys, folder)

    def safe(self, *, folder: str | Path | None = None, **keys: Unpack[SafeKeys]) -> Result:
        """Find the modes that engine orders can excite; keys such as ``engine_orders=range(1, 13), margin_percent=5.0``."""
        return self._answer("safe", keys, folder)

    def limit_cycle(
        self, *, verify: bool = False, folder: str | Path | None = None, **keys: Unpack[LimitCycleKeys]
    ) -> Result:
        """Find self-excited motions; keys such as ``wave_numbers=[3], points=40, in_time=True``.

        Parameters
        ----------
        verify
            Compare with time integration; same as the key ``in_time``.
        folder
            Folder for ``result.nc``; left out: the result stays in memory.
        keys
            Keys of the table [limit_cycle].

        Raises
        ------
        InputError
            If a key is unknown, or the model does not allow the analysis.
        """
        checks = frozenset({"verify"} if verify else ())
        return self._answer("limit_cycle", keys, folder, checks)

    def nonlinear_mode(self, *, folder: str | Path | None = None, **keys: Unpack[NonlinearModeKeys]) -> Result:
        """Follow modes over their amplitude; keys such as ``modes=[1, 2], amplitude_mm=(1e-3, 1.0), points=40``."""
        return self._answer("nonlinear_mode", keys, folder)

    def resonance(
        self,
        of: Callable[[float], Assembly] | None = None,
        *,
        folder: str | Path | None = None,
        **keys: Unpack[ResonanceKeys],
    ) -> Result:
        """Follow resonance peaks over a design parameter.

        Parameters
        ----------
        of
            Function that returns the model for a value of the parameter. Left out: `parameter` is a factor on the loads, ``"excitation"``
            or ``"static_load"``, or a field of the contact laws, as ``"mu"``.
        folder
            Folder for ``result.nc``; left out: the result stays in memory.
        keys
            Keys of the table [resonance], such as ``frequency_hz=(80, 160), parameter="excitation", values=[1, 2, 5]``.

        Raises
        ------
        InputError
            If a key is unknown, or the model does not allow the analysis.
        """
        at = None if of is None else lambda _, value: of(value)
        return self._answer("resonance", {"parameter": "value", **keys}, folder, at=at)

    def residual_tractions(self, *, folder: str | Path | None = None, **keys: Unpack[ResidualTractionsKeys]) -> Result:
        """Bound the response over all possible residual tractions of sticking contacts; keys such as ``frequency_hz=(150, 170), points=25``."""
        return self._answer("residual_tractions", keys, folder)

    def modal_synthesis(self, *, folder: str | Path | None = None, **keys: Unpack[ModalSynthesisKeys]) -> Result:
        """Find forced responses at many levels from one nonlinear mode; keys such as ``levels=[0.5, 1, 2], mode=1, direct=True``."""
        return self._answer("modal_synthesis", keys, folder)

    def all_motions(self, *, folder: str | Path | None = None, **keys: Unpack[AllMotionsKeys]) -> Result:
        """Search for motions that the sweep misses; keys such as ``frequency_hz=(80, 160), frequencies=5, starts=20, solves=2000``."""
        return self._answer("all_motions", keys, folder)

    def quasi_periodic(self, *, folder: str | Path | None = None, **keys: Unpack[QuasiPeriodicKeys]) -> Result:
        """Compute motions with two frequencies; keys such as ``frequencies_hz=[150.0, 160.0], second_hz=212.0, accuracy_percent=0.5``.

        A load with a frequency of its own (`Load.omega`, `Load.omega_ratio`) gives the second frequency. Without one, a self-excited second
        tone is searched for.
        """
        return self._answer("quasi_periodic", keys, folder)

    def run_up(self, *, folder: str | Path | None = None, **keys: Unpack[RunUpKeys]) -> Result:
        """Follow the response over speed along engine orders; keys such as ``speeds_rpm=(3000, 9000), engine_orders=[4, 6], high=3``."""
        return self._answer("run_up", keys, folder)

    def _answer(
        self,
        name: str,
        keys: Mapping[str, Any],
        folder: str | Path | None,
        checks: frozenset[str] = frozenset(),
        at: Callable[[str, float], Assembly] | None = None,
    ) -> Result:
        settings = SimpleNamespace(**_tables(name, keys))
        case = Case(0, "", {}, settings, lambda: self, "", Path.cwd(), checks, at=at)
        with by_default(), one_loaded_blas_thread():
            title = f"{name.replace('_', ' ').capitalize()} of a model"
            outcome = answer(named(name), [case], title, as_tables(self, name, keys))
        result = result_of(outcome)
        if folder is None:
            return result
        Path(folder).mkdir(parents=True, exist_ok=True)
        return replace(result, path=result.save(folder))

    def __repr__(self) -> str:
        lines = [f"Model: {_counted(self)}"]
        lines += [f"  part {name}: {_part(part)}" for name, part in self.parts.items()]
        lines += [f"  contact {name}: {_contact(c)}" for name, c in self.contacts.items()]
        lines += [f"  join {name}: {' with '.join(j.between)}" for name, j in self.joins.items()]
        for name, load in self.loads.items():
            kind = f"harmonic {load.harmonic}" if load.harmonic else "static"
            lines.append(f"  load {name}: {load.newton:g} N on {load.on}, {kind}")
        lines += [f"  output {output.name}: {output.on}" for output in self.outputs]
        if self.speed:
            lines.append(f"  rotation: {self.speed / RPM:g} rpm")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def _counted(model: Assembly) -> str:
    sizes = {"part": model.parts, "contact": model.contacts, "load": model.loads}
    return ", ".join(f"{len(own)} {name}{'s' * (len(own) != 1)}" for name, own in sizes.items())


def _part(part: Part) -> str:
    kind = "rigid body" if part.body is not None else f"{part.structure.stiffness.shape[0]} dofs"
    wheel = f", one of {part.sectors} sectors" if part.sectors > 1 else ""
    return f"{kind}{wheel}"


def _contact(contact: Contact) -> str:
    return f"{' with '.join(contact.between)}, {type(contact.law).__name__}"


def _sections(name: str) -> dict[str, type[Section]]:
    """Return the tables of an analysis by name: its own table and shared tables."""
    own = named(name)
    fields = {table: Tables.model_fields[table].annotation for table in own.shared}
    return {name: own.table, **fields}  # type: ignore[dict-item]


def _with_keys(name: str) -> Signature:
    """Return the signature of a method with the keys of its tables, as `help` and notebooks show it."""
    own = signature(getattr(Model, name))
    first = [p for p in own.parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    fields = {
        key: f
        for section in _sections(name).values()
        for key, f in section.model_fields.items()
        if key not in OF_THE_MODEL and key not in own.parameters
    }
    return own.replace(
        parameters=[
            *first,
            *(
                Parameter(
                    key,
                    Parameter.KEYWORD_ONLY,
                    default=Parameter.empty
                    if f.is_required()
                    else f.get_default(call_default_factory=True, validated_data={}),
                )
                for key, f in fields.items()
            ),
        ]
    )


def _method(name: str) -> Callable[..., Result]:
    """Return a method for an analysis that `Model` does not define."""

    def ask(self: Model, *, folder: str | Path | None = None, **keys: Any) -> Result:
        return self._answer(name, keys, folder)

    ask.__name__, ask.__doc__ = name, f"Answer the question [{name}]; its keys are the keys of the table."
    return ask


for _name in ANALYSES:
    if not hasattr(Model, _name):
        setattr(Model, _name, _method(_name))
    getattr(Model, _name).__signature__ = _with_keys(_name)


def _frequencies(hz: object) -> list[float]:
    """Return the frequencies of a range or a list, Hz."""
    example = "Give a range: hz=(8, 16), or a list of frequencies: hz=[8, 10, 12]."
    if isinstance(hz, int | float):
        raise input_error("forced_response: hz", f"is one number, {hz:g}", example)
    try:
        return [float(f) for f in hz]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise input_error("forced_response: hz", f"is {hz!r}, which holds no numbers", example) from None


def _of_a_table(table: str, own: type[Section], value: Any) -> str:
    """Return the remedy for a table of a study file that is given as one key."""
    if table == "harmonics" and not isinstance(value, Mapping):
        return f"Its keys stand alone. The highest harmonic is harmonics.high: high={value!r}."
    given = (
        [key for key in value if key in own.model_fields] if isinstance(value, Mapping) else list(own.model_fields)[:3]
    )
    return f"Its keys stand alone: {', '.join(f'{key}=…' for key in given)}."


def _tables(name: str, keys: Mapping[str, Any]) -> dict[str, Section]:
    """Sort keys into the tables of an analysis and validate them."""
    sections = _sections(name)
    home = {key: table for table, own in sections.items() for key in own.model_fields}
    values: dict[str, dict[str, Any]] = {table: {} for table in sections}
    for key, value in keys.items():
        if key in sections and key not in home:
            raise input_error(
                f"{name}: {key}", "is a table of a study file, no key", _of_a_table(key, sections[key], value)
            )
        if key not in home or key in OF_THE_MODEL:
            known = [k for k in home if k not in OF_THE_MODEL]
            raise input_error(f"{name}: {key}", "is no key of this question", nearest_key(key, known, value))
        values[home[key]][key] = _plain(value)
    return {table: _validated(own, values[table], name) for table, own in sections.items()}


def _validated(section: type[Section], values: Mapping[str, Any], place: str) -> Section:
    try:
        return section.model_validate(values)
    except ValidationError as error:
        raise told(place, section, error) from None


def _plain(value: Any) -> Any:
    """Return tuples, ranges and arrays as lists, as a study file has them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain(v) for v in value] if isinstance(value, tuple | range | list) else value
