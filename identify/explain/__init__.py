"""Finds where a simulation and a recording part, names the physics left out, and proves it on data not used for it."""

from identify.explain.explain import explain
from identify.explain.explanation import Explanation, Finding, Location

__all__ = ["Explanation", "Finding", "Location", "explain"]
