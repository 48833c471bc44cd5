"""Small answers of the solvers have all the numbers that they had: motions, and what is estimated, counted and chosen on the way."""

import pytest
from held_numbers import ANSWERS, held, of_answer
from held_pages import differences


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_has_the_numbers_that_it_had(name: str) -> None:
    changed = differences(of_answer(name), held(name))
    assert not changed, "\n".join(
        [f"{len(changed)} changes. Are they meant? python tests/held_numbers.py", *changed[:20]]
    )
