"""Compares public ROS 1 packages on rosz with real ROS 1.

``python -m tests.corpus {launch,types,nodes} REPOSITORY…`` takes checkouts of repositories that are
no part of this one, and the folder of the results. It is no test: it takes long, and what it finds
depends on the checkouts. Debian's ROS 1 is the other side. `packages` finds the packages, `devel`
builds what catkin's devel space would hold, and `launch`, `types` and `nodes` compare.
"""
