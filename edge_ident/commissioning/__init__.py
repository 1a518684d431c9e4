"""The whole job on a board: capture, run, verification, the life of gains, checks, latency.

The command line takes the modules from here, which `__init__.pyi` lists. Each loads when it is
first named.
"""

from edge_ident.support.lazy import lazy_names

__getattr__, __all__ = lazy_names(__name__, __path__[0])
