"""topic_tools: programs that pass messages on without decoding them (ROS wiki, topic_tools).

`passing` has the input and the output that the programs of `relay` and `mux` are made of.
`expression` makes new messages from parts of others.
"""
