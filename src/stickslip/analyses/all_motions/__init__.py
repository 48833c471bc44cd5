"""All motions of a load: table, problem, records, verdicts."""
