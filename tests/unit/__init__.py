"""One folder a package; each file tests one module."""
