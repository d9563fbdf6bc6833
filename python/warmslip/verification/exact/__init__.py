"""Scenes whose answer is a formula: one module a family, each case a function that runs them and returns its lines."""
