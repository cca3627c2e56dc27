"""Borders of the backlash that are no straight lines."""
