"""Trials on a circuit: parts are changed in a netlist, and the tool must name what that causes."""
