"""Identifies and explains recorded traces: pure numerics, no ports, files or clocks."""
