"""Finds where a simulation and a recording part, names the physics left out, and proves it on data not used for it."""
