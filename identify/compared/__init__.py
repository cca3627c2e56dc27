"""What changed on a bench between two recordings, and does the change exceed what the recordings can be sure of?"""

from identify.compared.compare import compare

__all__ = ["compare"]
