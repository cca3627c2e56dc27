"""Protocols a bench can play, each opening with the question it answers."""
