"""Drivers for data acquisition devices and the emulators that stand in for them."""
