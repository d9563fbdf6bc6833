"""Meshes and steps graded to where the solution is singular."""
