"""The table [harmonics]: harmonics that are kept, and their selection."""

from collections.abc import Callable, Iterable, Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, WrapValidator, field_validator, model_validator
from pydantic_core import PydanticCustomError

from stickslip.errors import InputError, did_you_mean
from stickslip.harmonic.harmonic_set import Harmonics as Support
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.harmonic.strategies import FIXED, OPTIONS, STRATEGIES, VERIFYING, options_of
from stickslip.response.forced.choices import PUBLISHED, RUNGS, SELECTION, Passages
from stickslip.study.file.section import Positive, Section, custom_error, own_object, refuse_all, shown
from stickslip.study.own_code import is_address, made
from stickslip.study.questions import loaded

HIGHEST = 200  # highest harmonic that a study may keep
SELECTIONS = tuple(STRATEGIES)
SAMPLES_A_HARMONIC = 8  # smallest number of samples of a period over the highest harmonic
MEMBERS = ("judge", "threshold", "verifies")  # required attributes of a strategy
PLACES = ("answer", "along", "outputs", "contacts")

Harmonic = Annotated[int, Field(ge=1, le=HIGHEST)]
Kept = Harmonic | list[Harmonic]


def _named_or_own(given: Any, check: Callable[[Any], Any], info: ValidationInfo) -> Any:
    """Return a strategy: objects from Python unchanged, names and module paths after a check."""
    if is_address(given):
        own_object(info, given, "strategy", MEMBERS, instance=True)
        return given
    plain = given is None or isinstance(given, str | int | float | list | dict)
    return check(given) if plain else given  # `check_strategy` reports missing attributes of an object


Selection: Any = Annotated[Literal[SELECTIONS], WrapValidator(_named_or_own)]


class Harmonics(Section):
    """Harmonics that are kept, and their selection at each frequency."""

    low: Kept = Field(
        1,
        description=f"harmonics of the first passage, as the highest of all, 1 to {HIGHEST}, or as a list such as [1, 3]; left out: the harmonics that loads drive, which is 1 except for loads with a harmonic or several engine orders",
    )
    high: Literal["auto"] | Kept = Field(
        "auto",
        description=f"auto: harmonics are raised ({', '.join(map(str, RUNGS))}) until the judgement of each point is quiet, and audited. A number, 1 to {HIGHEST}, or a list such as [1, 3, 5] sets the highest harmonics kept, as published",
    )
    samples: int = Field(256, ge=16, le=8192, description="time samples of a period, 16 to 8192")
    selection: Selection = Field(
        SELECTION,
        description=f"what chooses the harmonics of a frequency: {', '.join(SELECTIONS)}; or my_module:Name, a strategy of your own, with --allow-code",
    )
    passages: Passages = Field(
        "double",
        description="double: finish the response with few harmonics, then repeat what needs more; single: settle each frequency "
        "before the next one, as selections that predict the next frequency always do",
    )
    alert_threshold_percent: Positive = Field(
        5.0,
        description="a percentage greater than zero: frequencies whose predicted error is larger get more harmonics "
        "(for selections that predict an error)",
    )
    strategy_threshold: Positive | None = Field(
        None,
        description="threshold of a selection whose indicator is no error, greater than zero; left out: as in its source",
    )
    per_dof: bool = Field(
        False,
        description="harmonics chosen for each retained coordinate by itself, as in the sources (for maple and grolet)",
    )
    similarity: bool = Field(
        False,
        description="true: at every point of [forced_response] the Jacobians with the first and with the most harmonics are compared (ΔJ and Γ of "
        "Gastaldi and Berruti), and their blocks between harmonics stored at the peak; up to 2000 unknowns",
    )
    repeats: bool = Field(
        False,
        description="solve a frequency again until it has the harmonics predicted for it (for grolet, laxalde, suess_spectral and suess_jacobian)",
    )
    alert_over: Literal["answer", "along", "outputs", "contacts"] | list[str] = Field(
        "answer",
        description="where the error is taken. answer: every output, as a vector, relative to itself or to 1 % of the largest of its unit. As "
        "published, by harmonic and dof, it is taken along (outputs along the excitation), outputs (in all directions), contacts (second "
        'surfaces at the contact points) or at labels such as ["tip1.x", "L1.1.z", "damper.x"]',
    )
    alert_harmonics: list[Annotated[int, Field(ge=0, le=HIGHEST)]] | None = Field(
        None,
        min_length=1,
        description="harmonics whose error is taken, 0 for the static part; left out: the harmonics that the excitation drives",
    )

    @field_validator("low", "high", mode="before")
    @classmethod
    def _is_support(cls, given: Any, info: ValidationInfo) -> Any:
        kinds, remedy = "", ""
        if info.field_name == "high":
            kinds, remedy = "'auto', ", "'auto' raises them until each point is quiet; "
            if given == "auto":
                return given
        one = isinstance(given, int) and not isinstance(given, bool)
        entries = [given] if one else given
        if isinstance(entries, list) and entries and all(map(_harmonic, entries)):
            return given
        raise custom_error(
            f"must be {kinds}a harmonic from 1 to {HIGHEST} or a list of them, got {shown(given)}",
            f"{remedy}5 keeps all up to the fifth; [1, 3, 5] keeps these alone. The static term is always kept.",
        )

    @field_validator("alert_over", mode="before")
    @classmethod
    def _is_place(cls, given: Any) -> Any:
        labels = isinstance(given, list) and given and all(isinstance(v, str) for v in given)
        if given in PLACES or labels:
            return given
        remedy = did_you_mean(given, list(PLACES)) if isinstance(given, str) else "Give one of these."
        raise custom_error(f"must be {', '.join(PLACES)} or a list of labels, got {shown(given)}", remedy)

    @model_validator(mode="after")
    def _agree(self) -> Self:
        refuse_all([*_of_supports(self), *_of_options(self), *_of_threshold(self), *_of_alert(self)])
        return self

    @property
    def low_harmonics(self) -> Support:
        """Harmonics of the first passage, from 0."""
        return harmonics_of(self.low)

    def beginning(self, driven: Iterable[int]) -> Support:
        """Return the harmonics of the first passage, from 0; without `low` the harmonics of the loads."""
        own = {h for h in driven if h > 0}
        return self.low_harmonics if "low" in self.model_fields_set or not own else harmonics_of(own)

    @property
    def high_harmonics(self) -> Support:
        """Harmonics of the reference, from 0; with ``auto`` the published set, or the set of the first passage if it is larger."""
        if self.high == "auto":
            return harmonics_of(max(PUBLISHED, self.low_harmonics[-1]))
        return harmonics_of(self.high)

    @property
    def own_strategy(self) -> Any:
        """The user's strategy; None for a built-in one."""
        if is_address(self.selection):
            return made(loaded(self.selection), self.selection)
        return None if isinstance(self.selection, str) else self.selection

    @property
    def strategy(self) -> Any:
        """The strategy that chooses harmonics, with the threshold of this table if given."""
        if self.own_strategy is not None:
            return self.own_strategy
        from stickslip.harmonic.selection import strategy_named  # loads the contact kernels

        verifies = self.selection in VERIFYING
        threshold = self.alert_threshold_percent / 100 if verifies else self.strategy_threshold
        return strategy_named(self.selection, threshold, **self._options)

    @property
    def _options(self) -> dict[str, bool]:
        return {name: True for name in options_of(self.selection) if getattr(self, name)}

    @property
    def chooser(self) -> Any:
        """Argument `selection` of a sweep: the name of a strategy, or the strategy with the threshold of this table."""
        as_named = self.own_strategy is None and self.strategy_threshold is None and not self._options
        return self.selection if as_named else self.strategy


def _harmonic(given: Any) -> bool:
    return isinstance(given, int) and not isinstance(given, bool) and 1 <= given <= HIGHEST


def _of_supports(table: Harmonics) -> Iterator[PydanticCustomError]:
    low, high = table.low_harmonics, table.high_harmonics
    if table.high == "auto":
        pass  # contains all harmonics up to its highest
    elif "low" not in table.model_fields_set and isinstance(table.high, list):
        pass  # the loads define which harmonics it must contain
    elif isinstance(table.low, int) and isinstance(table.high, int) and table.high < table.low:
        yield custom_error(f"must not be below low = {table.low}, got {table.high}", "Raise it, or lower low.", "high")
    elif not set(low) <= set(high):
        lacking = ", ".join(str(h) for h in low if h not in high)
        yield custom_error(
            f"must hold every harmonic of low = {table.low}, got {table.high}",
            f"Add {lacking}, or leave that out of low.",
            "high",
        )
    yield from _of_samples(table, high[-1])


def _of_samples(table: Harmonics, highest: int) -> Iterator[PydanticCustomError]:
    """Refuse too few samples under the key in the file: ``samples``, or the key of the highest harmonic."""
    fewest = SAMPLES_A_HARMONIC * highest
    if table.samples >= fewest:
        return
    key = "low" if table.high == "auto" and table.low_harmonics[-1] == highest else "high"
    value = getattr(table, key)
    better = 2 ** (fewest - 1).bit_length()
    if "samples" in table.model_fields_set:
        of = f"the harmonic {highest} that {key} = {value!r} begins with" if value == "auto" else f"{key} = {value}"
        yield custom_error(
            f"must be at least {SAMPLES_A_HARMONIC} times {of}, got {table.samples}",
            f"Give at least {fewest}, better {better}.",
            "samples",
        )
    else:
        yield custom_error(
            f"needs at least {fewest} samples of a period, {SAMPLES_A_HARMONIC} times its highest harmonic, and samples is "
            f"{table.samples} where it is not given, got {value}",
            f"Add samples = {better}, or lower {key}.",
            key,
        )


def _of_options(table: Harmonics) -> Iterator[PydanticCustomError]:
    for option in OPTIONS:
        if getattr(table, option) and option not in options_of(table.selection):
            having = ", ".join(name for name in STRATEGIES if option in options_of(name))
            yield custom_error(
                f"has no meaning for selection = {table.selection!r}, got true",
                f"Remove it, or choose one of {having}.",
                option,
            )


def _of_threshold(table: Harmonics) -> Iterator[PydanticCustomError]:
    given = {"alert_threshold_percent", "strategy_threshold"} & table.model_fields_set
    if table.own_strategy is not None:
        name = type(table.own_strategy).__name__
        yield from (
            custom_error(f"has no meaning for the strategy {name}", f"Give {name} its own threshold.", key)
            for key in sorted(given - {"alert_threshold_percent"} if table.high == "auto" else given)
        )
        return
    verifies = table.selection in VERIFYING
    if table.strategy_threshold is not None and table.selection in FIXED:
        yield custom_error(
            f"has no meaning for selection = {table.selection!r}, got {table.strategy_threshold:g}",
            "Remove it: nothing is decided.",
            "strategy_threshold",
        )
    elif table.strategy_threshold is not None and verifies:
        yield custom_error(
            f"is not for {table.selection}, which predicts an error, got {table.strategy_threshold:g}",
            "Give alert_threshold_percent instead.",
            "strategy_threshold",
        )
    elif given:
        try:
            _ = table.strategy
        except InputError as error:  # limits of the strategy itself
            key = "alert_threshold_percent" if verifies else "strategy_threshold"
            yield custom_error(error.problem, error.remedy, key)


def _of_alert(table: Harmonics) -> Iterator[PydanticCustomError]:
    missing = [h for h in table.alert_harmonics or () if h not in table.low_harmonics]
    if missing:
        yield custom_error(
            f"names harmonic {missing[0]}, which low = {table.low} does not keep: nothing is known of its error",
            "Add it to low, or leave it out.",
            "alert_harmonics",
        )
