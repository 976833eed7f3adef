"""A simulation of the parameter store: cores of replicas, and all that is between them.

Everything runs in one thread, from one seed: a network that delays, reorders, repeats and loses
messages and that is cut in one direction or both, processes that stop, wake, crash, leave and
restart, disks that are full or lie, and clocks that are hours wrong. What must hold is checked
after every step of a core. Parts:

- `disk`, `process`, `schedule`, `world`: what the cores run on;
- `checks`: what must hold; `answers`: what the answers to calls promise; `violation`: the error;
- `histories`: what happens to a world, drawn at random;
- `exploration`: what may happen next in the small worlds of `scripts`, from each of their `states`;
  `stage`: one step of one process for it, on one of its `copies`; `search` tries all, a move at a
  time, and `sweep` many at a time, by `rules` for `local_states`, on `tables`;
- `mutations`: deliberate faults of the core, which the checks must find.

``python -m tests.params.simulation --help`` runs longer than the tests do.
"""
