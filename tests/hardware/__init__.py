"""Does the circuit on the bench do what it was drawn to do? Run on a device: ``pytest --rig-device ADDRESS``."""
