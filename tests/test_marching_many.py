"""Marching many contacts: Newton's matrix of a step is corrected where contacts change, and modes that do not move each other are turned."""

from dataclasses import replace

import numpy as np

from evidence.models.many_contacts import two_plates
from stickslip.response.time.stepping.marcher import Marcher, prepared

OMEGA = 2.0 * np.pi * 1067.0
PERIODS, STEPS = 2, 256


def lifted(damping: float = 0.0) -> Marcher:
    """Return twelve contacts under a load that opens a third of them, with a damper between the plates that couples their modes."""
    plates = two_plates(12)
    system, load = plates.system, plates.load(0.3)
    structure = system.structure
    own = structure.damping.toarray() if hasattr(structure.damping, "toarray") else structure.damping
    own = own.copy()
    own[system.outputs[2], system.outputs[2]] += damping
    interface = system.interface
    return prepared(replace(structure, damping=own), interface.gap_operator, interface.laws, load, OMEGA, STEPS)


def marched(marcher: Marcher) -> np.ndarray:
    """Return displacements, gaps and forces of the last of some periods from rest."""
    state = marcher.begin(np.zeros(2 * marcher.n), marcher.contacts.start)[0]
    record = marcher.record()
    for _ in range(PERIODS):
        assert marcher.march(state, record) == 0
    return record.rows


def test_correcting_rows_of_newtons_matrix_is_factoring_it() -> None:
    """Without room for changed rows every change of a contact's state makes new factors; the motion is the same."""
    marcher = lifted()
    changes = marcher._work[1].changes
    assert changes.row.size == 9
    corrected = marched(marcher)
    shut = corrected[:, marcher.n + marcher.k + 2 :: 3] != 0.0
    assert 0.1 < np.mean(shut) < 0.95  # contacts open and close
    assert changes.taken[0] > 0 or np.any(changes.unit)  # and rows were corrected
    laws, newton = lifted()._work
    none = newton.changes._replace(
        row=np.zeros(0, dtype=np.int64), unit=np.zeros((0, marcher.k)), less=np.zeros((0, marcher.k))
    )
    anew = marched(replace(marcher, _work=(laws, newton._replace(changes=none))))
    size = np.abs(anew).max(axis=0)
    np.testing.assert_allclose(corrected, anew, rtol=0, atol=1e-9 * size.max())
    assert np.all(np.abs(corrected - anew).max(axis=0) <= 1e-6 * size)


def test_turning_modes_is_the_whole_matrix() -> None:
    """With proportional damping modes are turned one by one; a damper at a point couples them, and the whole matrix is taken."""
    alone = lifted()
    assert alone.operators.turn.shape == (4, alone.n)
    assert lifted(damping=5.0).operators.turn.size == 0
    whole = replace(alone, operators=alone.operators._replace(turn=np.zeros((0, alone.n))))
    turned, taken = marched(alone), marched(whole)
    size = np.abs(taken).max(axis=0)
    assert np.all(np.abs(turned - taken).max(axis=0) <= 1e-6 * size)
