"""What does a model answer to the input of a trace?"""

from identify.chain import simulate
from identify.effects import chain_of
from identify.model import Model
from identify.simulate import SUBSTEPS
from identify.trace import Array, Trace


def simulated(model: Model, trace: Trace) -> Array:
    """Return the answer of ``model``, from rest, to the u of ``trace``, V, shape (N,); its y is not looked at.

    Raises ValueError for a model without values, or physics the catalogue has not.
    """
    return simulate(chain_of(model, trace.intersample), trace, SUBSTEPS)
