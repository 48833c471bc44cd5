"""Direct time integration that shares no law and no step with the library: the judge of its laws, its steps and its balance.

`propagator`, `settling` and parts of `transient` are copies of the time integration of the library and judge nothing of it; `time_step`, `hysteresis` and
`verlet` were written anew (``docs/judges.md``).
"""
