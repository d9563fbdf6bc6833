"""Verification on a scene of one's own: exact answers, expected orders, graded grids, uncertainty, hypotheses, theory."""
