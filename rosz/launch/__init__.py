"""Launch files: ``plan`` reads them into a plan, ``run`` carries a plan out.

The two halves sit on different floors, so nothing is imported here: ``plan`` is pure, ``run`` needs
sessions and processes.
"""

__all__: tuple[str, ...] = ()
