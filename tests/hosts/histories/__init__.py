"""Histories of faults between machines: cuts, stops and kills, with writes all the time.

``python -m tests.hosts.histories SEED…`` or ``FIRST-LAST`` plays the histories of some seeds, in
network namespaces (as root), and prints what became of each. A seed decides what happens and when,
between three hosts. With ``--ends`` there are four, and writers are told to end.
"""
