"""A law of a user's script: it runs, agrees with the built-in law it contains, and is compiled once."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stickslip.contact.law import law_kernel
from stickslip.errors import InputError

EXAMPLE = Path(__file__).parents[1] / "examples" / "own_law.py"

AT_A_PROMPT = """
import numpy as np
import stickslip as ss


def step(displacement, velocity, state, parameters, force, new_state, jac, status):
    force[:] = 0.0
    force[2] = parameters[0] * displacement[2]
    jac[2, 2] = parameters[0]
    status[:] = 0


class Spring:
    kernel = ss.contact.law_kernel(step)
    pairs = 5
    def parameters(self): return np.array([3.0])
    def initial_state(self): return np.zeros(0)
    def stuck_stiffness(self): return np.array([0.0, 0.0, 3.0])


period = ss.harmonic.contact_forces(np.ones((3, 3)), ss.contact.compile_contacts([Spring()]), 16)
print(np.max(np.abs(period.coefficients - [0.0, 0.0, 3.0])) < 1e-14)
"""


def run(script: Path) -> str:
    done = subprocess.run([sys.executable, "-W", "error", str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.validation
def test_own_law_agrees_with_the_built_in_one_and_is_compiled_once(tmp_path):
    script = shutil.copy(EXAMPLE, tmp_path)
    first, second = run(script), run(script)
    assert "compiled 1, loaded 0" in first
    assert "compiled 0, loaded 1" in second
    for text in (first, second):
        built_in, same, stronger = (float(n) for n in re.findall(r"([\d.]+) µm", text))
        # the same problem by two evaluators, each solved to 1e-8 or better; printed to 1e-6
        assert same == pytest.approx(built_in, rel=1e-6)
        # more friction at the same limit force: the peak falls below that of the unloaded damper, and far
        assert 0.2 * built_in < stronger < 0.8 * built_in


def test_a_law_typed_at_a_prompt_works_without_a_file():
    done = subprocess.run([sys.executable, "-c", AT_A_PROMPT], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "True", done.stderr


def test_a_step_is_compiled_when_its_kernel_is_first_read():
    def step(displacement, velocity, state, parameters, force, new_state, jac, status):
        return unknown  # noqa: F821

    class Law:
        kernel = law_kernel(step)

    with pytest.raises(InputError, match=r"step: is no step that numba compiles: .*unknown"):
        _ = Law.kernel
