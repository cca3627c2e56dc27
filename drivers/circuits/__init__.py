"""Netlists: circuits a bench may be wired as, and models of the parts they are made of."""
