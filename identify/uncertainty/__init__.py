"""How sure an answer is, in which scale, and by which law."""
