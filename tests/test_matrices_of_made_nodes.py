"""Stored matrices of CalculiX with nodes that it made: of beams, and of incompatible modes."""

from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix import read_calculix_matrices
from stickslip.model.readers.calculix_deck import assemble_deck, read_deck
from stickslip.model.readers.units import Units

DATA = Path(__file__).parent / "data" / "calculix"
BEAM_HZ = [115.3885, 224.2753, 1118.927, 2060.951]  # ccx 2.20 of the same deck


def copied(folder, stem, change=lambda text: text):
    for path in DATA.glob(f"{stem}.*"):
        (folder / path.name).write_bytes(path.read_bytes())
    deck = folder / f"{stem}.inp"
    deck.write_text(change(deck.read_text()))
    return folder / stem


def test_nodes_that_calculix_made_of_beams_are_copies():
    found = read_calculix_matrices(DATA / "beam", units=Units.mm_t_s())
    np.testing.assert_allclose(natural_frequencies(found, 4), BEAM_HZ, rtol=1e-6)
    numbers = np.unique(found.dofs.node)
    assert numbers[numbers % 10 == 3].tolist() == [3, 13, 23, 33, 43, 53, 63, 73]
    assert len(set(zip(found.dofs.node.tolist(), found.dofs.component, strict=True))) == found.n
    assert found.sets["NA"].size == found.n  # a load on the set acts on all copies
    assert np.isnan(found.dofs.position).all()


def test_a_study_of_matrices_of_beams(tmp_path):
    copied(tmp_path, "beam")
    (tmp_path / "study.toml").write_text(
        'schema_version = 2\n[part.beam]\nfile = "beam.sti.gz"\nunits = "mm-t-s"\n[modes]\nnumber = 4\n'
    )
    result = ss.Study.from_file(tmp_path / "study.toml").run()
    np.testing.assert_allclose(np.ravel(result["modes"]["frequency_hz"].values), BEAM_HZ, rtol=1e-6)


def test_dofs_named_twice_are_refused_of_solids(tmp_path):
    stem = copied(tmp_path, "beam", lambda text: text.replace("TYPE=B32", "TYPE=C3D20"))
    with pytest.raises(
        InputError,
        match=r"beam\.dof: line 4: names a dof twice, direction 2 of node 1\..*the deck that CalculiX ran, too",
    ):
        read_calculix_matrices(stem, units=Units.mm_t_s())


def test_incompatible_modes_are_coordinates_and_condense_to_the_deck():
    found = read_calculix_matrices(DATA / "one_c3d8i", plausible=False)
    assert found.dofs.component.count("mode") == 9
    assert (found.dofs.node[24:] == -1).all()
    K, M = found.stiffness.toarray(), found.mass.toarray()
    whole = np.vstack([np.eye(24), -np.linalg.solve(K[24:, 24:], K[24:, :24])])
    own = assemble_deck(read_deck(DATA / "one_c3d8i.inp", plausible=False))
    for ours, theirs in ((own.stiffness, K), (own.mass, M)):
        exact = whole.T @ theirs @ whole
        assert np.linalg.norm(ours.toarray() - exact) < 1e-12 * np.linalg.norm(exact)


def test_nodes_that_a_deck_lacks_are_refused_of_other_bricks(tmp_path):
    stem = copied(tmp_path, "one_c3d8i", lambda text: text.replace("TYPE=C3D8I", "TYPE=C3D8"))
    with pytest.raises(InputError, match=r"lacks 3 nodes, e\.g\. 9, 10, 11"):
        read_calculix_matrices(stem, plausible=False)
