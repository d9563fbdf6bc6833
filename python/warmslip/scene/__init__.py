"""Scenes: the tables of a scene file, their checks, the reader and what a scene will do. No compiled code."""
