"""How the answer of a chain moves with every number in it: exactly and eight abreast, or by differences."""
