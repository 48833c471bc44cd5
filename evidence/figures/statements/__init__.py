"""What the paper says of its figures, and what this package finds: one row a statement, judged by code.

Only the paper's own statements are counted, each once, in the order of the paper. A row's numbers, its verdict and the reason of a
disagreement come from the evidence.
"""

from evidence.figures.evidence import Evidence
from evidence.figures.statements.cost import statement_of_control, statement_of_passages, statements_of_cost
from evidence.figures.statements.coupling import statements_of_coupling
from evidence.figures.statements.errors import statements_of_errors
from evidence.figures.statements.jacobians import statements_of_jacobians
from evidence.figures.statements.responses import statements_before, statements_in_time
from evidence.figures.statements.second_damper import statements_of_second_damper
from evidence.figures.statements.statement import Statement


def statements(evidence: Evidence) -> list[Statement]:
    """Return every row, in the order of the paper."""
    before = statements_before(evidence)
    adequate = [row for row in before if row.section == "4.5.2"]
    return [
        *statements_of_coupling(evidence),
        statement_of_passages(evidence),
        *adequate,
        statement_of_control(evidence),
        *(row for row in before if row.section != "4.5.2"),
        *statements_in_time(evidence),
        *statements_of_errors(evidence),
        *statements_of_jacobians(evidence),
        *statements_of_cost(evidence),
        *statements_of_second_damper(evidence),
    ]
