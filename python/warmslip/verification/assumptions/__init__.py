"""The assumptions of the theory, held against a scene."""
