"""Records become variables of a result and come back from them."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from stickslip.analyses.columns import described, record_of, variables
from stickslip.analyses.page import report_html
from stickslip.analyses.resonance.table import ResonanceTable
from stickslip.arrays import FloatArray
from stickslip.column import column, columns_of, rows
from stickslip.study.analysis import Case, Solved, named
from stickslip.study.outcome import case_variables
from stickslip.study.questions import ANALYSES
from stickslip.study.store.archive import decode_record, encode_record, flat, from_flat
from stickslip.study.store.netcdf import one_case, stacked

TURN = 2 * np.pi


@dataclass(frozen=True, eq=False, kw_only=True)
class Leaf:
    size: float = column("m", "size of a leaf")
    green: bool = column("1", "1 where it is green")
    word: str = column("1", "what is said of it")
    later: float | None = column("s", "when it falls", default=None)


@dataclass(frozen=True, eq=False, kw_only=True)
class Bud:
    rank: int = column("1", "rank of a bud; -1 where there are no more")
    colour: str = column("1", "its colour")
    width: float = column("m", "its width")


@dataclass(frozen=True, eq=False, kw_only=True)
class Branch:
    number: int = column("1", "number of the branch")
    omega: float = column("Hz", "frequency of the branch", "frequency_hz", per=TURN)
    along: FloatArray = column("m", "place along the branch", along="point")
    leaves: tuple[Leaf, ...] = rows("leaf", "leaf_", "index of the branch of a leaf")
    buds: tuple[Bud, ...] = rows("bud", "bud_", beside=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class Tree:
    name: str = column("1", "name of the tree")
    height: float = column("m", "height of the tree")
    rings: FloatArray | None = column("m", "radii of its rings", along="ring", default=None)
    branches: tuple[Branch, ...] = rows("branch")


finite = st.floats(-1e6, 1e6)
leaves = st.builds(Leaf, size=finite, green=st.booleans(), word=st.text("abc", min_size=1))
buds = st.builds(Bud, rank=st.integers(0, 9), colour=st.text("abc"), width=finite)
lengths = st.lists(finite, min_size=1, max_size=3).map(np.array)
branches = st.builds(
    Branch,
    number=st.integers(0, 99),
    omega=finite,
    along=lengths,
    leaves=st.lists(leaves, max_size=3).map(tuple),
    buds=st.lists(buds, max_size=3).map(tuple),
)
trees = st.builds(
    Tree,
    name=st.text("abc", min_size=1),
    height=finite,
    rings=st.none() | lengths,
    branches=st.lists(branches, max_size=3).map(tuple),
)


def assert_same(found: Tree, wanted: Tree, *, trimmed: bool) -> None:
    assert (found.name, found.height) == (wanted.name, wanted.height)
    assert (found.rings is None) == (wanted.rings is None)
    if wanted.rings is not None:
        np.testing.assert_array_equal(found.rings, wanted.rings)
    for own, other in zip(found.branches, wanted.branches, strict=True):
        assert own.number == other.number
        assert own.omega == pytest.approx(other.omega, rel=1e-15)
        np.testing.assert_array_equal(own.along if trimmed else own.along[: len(other.along)], other.along)
        assert np.all(np.isnan(own.along[len(other.along) :]))
        assert [vars(leaf) for leaf in own.leaves] == [vars(leaf) for leaf in other.leaves]
        assert [vars(bud) for bud in own.buds] == [vars(bud) for bud in other.buds]


@given(st.lists(trees, min_size=1, max_size=3))
def test_records_come_back_from_the_dataset_of_several_cases(every: list[Tree]) -> None:
    data = xr.Dataset(stacked([variables(tree) for tree in every]))
    for i, tree in enumerate(every):
        assert_same(record_of(Tree, one_case(data, i)), tree, trimmed=False)


@given(trees)
def test_a_journal_gives_back_records_that_hold_records(tree: Tree) -> None:
    assert_same(decode_record(encode_record(tree), Tree), tree, trimmed=True)
    assert_same(from_flat(flat(tree), Tree), tree, trimmed=True)


def test_variables_say_unit_meaning_and_dimensions() -> None:
    leaf = Leaf(size=1.0, green=True, word="here")
    branch = Branch(number=3, omega=TURN, along=np.arange(2.0), leaves=(leaf,))
    found = variables(Tree(name="oak", height=9.0, branches=(branch,)))
    told = {name: (own.dims, own.attrs["units"], own.attrs["long_name"]) for name, own in found.items()}
    documented = {name: own for name, *own in described(Tree)}
    for name, own in told.items():
        assert list(own) == documented[name]
    assert found["frequency_hz"].values.tolist() == [1.0]
    assert found["leaf_green"].values.tolist() == [1]
    assert found["leaf_branch"].values.tolist() == [0]
    assert set(documented) - set(told) == {"rings", "leaf_later"}  # what is None has no variable


def test_variables_have_the_order_of_the_fields() -> None:
    @dataclass(frozen=True, eq=False, kw_only=True)
    class Hedge:
        leaves: tuple[Leaf, ...] = rows("leaf")
        length: float = column("m", "length of the hedge")

    assert list(variables(Hedge(length=2.0, leaves=(Leaf(size=1.0, green=True, word="a"),))))[-1] == "length"


def test_rows_may_have_variables_of_length_zero() -> None:
    @dataclass(frozen=True, eq=False, kw_only=True)
    class Bough:
        number: int = column("1", "number of the bough")
        leaves: tuple[Leaf, ...] = rows("leaf", "leaf_", "index of the bough", always=True)

    @dataclass(frozen=True, eq=False, kw_only=True)
    class Bush:
        boughs: tuple[Bough, ...] = rows("bough")

    bare = Bush(boughs=(Bough(number=0),))
    found = variables(bare)
    kinds = {name: found[name].dtype.kind for name in found if name != "number"}
    assert kinds == {"leaf_bough": "i", "leaf_size": "f", "leaf_green": "i", "leaf_word": "U", "leaf_later": "f"}
    assert all(found[name].shape == (0,) for name in kinds)
    assert record_of(Bush, found).boughs[0].leaves == ()
    assert variables(Bush()) == {}


def test_rows_beside_one_another_are_a_padded_table() -> None:
    bud = Bud(rank=4, colour="green", width=2.0)
    branch = Branch(number=0, omega=1.0, along=np.zeros(1))
    none = variables(Tree(name="a", height=1.0, branches=(branch, branch)))
    assert none["bud_rank"].sizes == {"branch": 2, "bud": 0}
    assert [one.buds for one in record_of(Tree, none).branches] == [(), ()]
    found = variables(Tree(name="a", height=1.0, branches=(branch, replace(branch, buds=(bud,)))))
    assert found["bud_rank"].dims == ("branch", "bud")
    assert found["bud_rank"].values.tolist() == [[-1], [4]]
    assert found["bud_colour"].values.tolist() == [[""], ["green"]]
    np.testing.assert_array_equal(found["bud_width"].values, [[np.nan], [2.0]])


def test_a_value_that_one_row_lacks_is_no_variable() -> None:
    first, second = (Leaf(size=1.0, green=True, word="a", later=later) for later in (1.0, None))
    branch = Branch(number=0, omega=1.0, along=np.zeros(1), leaves=(first, second))
    assert "leaf_later" not in variables(Tree(name="a", height=1.0, branches=(branch,)))
    there = variables(
        Tree(name="a", height=1.0, branches=(Branch(number=0, omega=1.0, along=np.zeros(1), leaves=(first,)),))
    )
    assert record_of(Tree, there).branches[0].leaves[0].later == 1.0


def test_an_older_result_without_a_variable_is_read() -> None:
    found = variables(Tree(name="a", height=1.0))
    del found["height"]
    assert np.isnan(record_of(Tree, found).height)


@pytest.mark.parametrize("name", ANALYSES)
def test_a_result_without_any_variable_is_read(name: str) -> None:
    for kind in named(name).answers:
        lengths = {dim: 3 for _, along, *_ in described(kind) for dim in along}
        found = record_of(kind, {}, lengths)
        for own in (n for n, c in columns_of(kind).items() if c.along and getattr(found, n) is not None):
            values = np.ravel(getattr(found, own)).tolist()
            missing = values in ([""] * len(values), [-1] * len(values)) or np.isnan(values).all()
            assert missing, own


@pytest.mark.parametrize(
    "name", [name for name in ANALYSES if name != "forced_response"]
)  # whose jobs always leave notes
def test_a_case_without_a_solution_has_a_result_tables_and_a_page(name: str) -> None:
    settings = SimpleNamespace(resonance=ResonanceTable.model_construct(parameter="excitation", by="amplitude"))
    case = Case(0, "", {}, settings, None, "", Path())
    data = named(name).dataset([Solved(case, (), {})]).assign(case_variables([case]))
    named(name).summary(data)
    assert all(v.level == "wrong" for v in named(name).verdicts(data))
    assert report_html(xr.DataTree(children={name: xr.DataTree(data)}))
