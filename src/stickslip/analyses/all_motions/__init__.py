"""All motions under a load: table, problem, records, verdicts."""
