"""Rig files: the plain model of a circuit, and what a simulated one conceals."""
