"""Emulated devices: one device model, several transports."""
