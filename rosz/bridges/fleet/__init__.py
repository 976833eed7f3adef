"""A robot whose names have a prefix beyond its machine, so that many equal robots share a network.

`plan` has the names that cross, as in ``fleet.yaml``; `fleet` the second session and the claim of
the prefix; `crossing` the tokens of both sides; `relays` samples and calls; `parameters` the copies
of the parameter store. It may import what a node may, and `rosz.params.replica`.
"""

from rosz.bridges.fleet.fleet import Fleet
from rosz.bridges.fleet.plan import FleetPlan, SharedNames, check_prefix, read_plan, read_share
