"""Independent SciPy implementation of the scheme (PF), shared by verification and benchmarks."""
