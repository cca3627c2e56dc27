"""Physics without a name: stages of free form, placed, fitted, stored in a model and played like any other."""
