"""lapswarm on more than one machine, by Ray: ``pip install lapswarm[ray]``.

``sweep`` runs a study over a grid of settings, ``islands`` optimises by islands that exchange solutions, ``Evaluator`` spreads
one population over the cluster. Each starts Ray on this machine where no cluster is; with ``RAY_ADDRESS`` set, or after
``ray.init(address=...)``, the same call works on the cluster. What a lost process, node or driver was at is done again, and the
result is the same to the bit.
"""

from ._evaluator import Evaluation, Evaluator
from ._islands import Archipelago, islands
from ._sweep import Sweep, sweep

__all__ = ["Archipelago", "Evaluation", "Evaluator", "Sweep", "islands", "sweep"]
