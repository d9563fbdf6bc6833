"""Meshes from files: read, checked, measured, refined. No compiled code."""
