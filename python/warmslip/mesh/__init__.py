"""Meshes from files: read, checked, refined. No compiled code."""
