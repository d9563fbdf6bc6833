"""Manufactured solutions: fields first, data derived from them."""
