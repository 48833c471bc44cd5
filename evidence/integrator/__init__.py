"""Direct time integration that shares no law and no step with the library: the judge of its integrator and of its balance."""
