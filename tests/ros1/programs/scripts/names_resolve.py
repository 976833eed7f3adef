#!/usr/bin/env python
"""What every kind of name resolves to, inside a namespace and under another name."""

import rospy

rospy.init_node("listener")
print("name", rospy.get_name(), rospy.get_caller_id())
print("namespace", rospy.get_namespace())
for name in ("chatter", "a/b", "/global", "/global/", "~", "~rate", "~/rate", "", "/", "a//b"):
    print(repr(name), "->", repr(rospy.resolve_name(name)))
print("elsewhere", rospy.resolve_name("x", "/other/node"), rospy.resolve_name("~x", "/other/node"))
print("remapped", rospy.remap_name("chatter"), rospy.remap_name("/chatter"))
