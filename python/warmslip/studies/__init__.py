"""Measuring: errors, rates, refinement studies, robustness, cost."""
