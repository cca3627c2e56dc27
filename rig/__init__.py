"""Runs protocols on a rig: protocol, plan, device contract, runner, recording, commands."""
