"""Live nodes of hiroz, which speaks rmw_zenoh, beside nodes of rosz: what holds in each direction.

hiroz is compiled once per machine from `peers/hiroz`. Where that is impossible, the tests skip.
"""
