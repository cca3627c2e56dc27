"""The commands as they are typed, from the shell to the exit code."""
