"""The paper's existence proof and error bound, run as computations."""
