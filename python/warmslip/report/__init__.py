"""A run for people: its cost in advance, its page afterwards."""
