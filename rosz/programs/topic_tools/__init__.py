"""topic_tools: programs that pass messages on without decoding them (ROS wiki, topic_tools).

`passing` has the input and the output that the programs of `relay` and `mux` are made of.
`mux_tools` calls the services of muxes; `expression` makes new messages from parts of others.
"""

PUBLIC_MODULES = ("expression", "mux", "mux_tools", "relay")

__all__ = ()
