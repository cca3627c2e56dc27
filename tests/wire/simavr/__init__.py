"""The firmware as it would be flashed, run by simavr, with the board around it and the simulated rig in front."""
