"""Verification on a scene of one's own: exact answers, entitled orders, graded grids, uncertainty, hypotheses, theory."""
