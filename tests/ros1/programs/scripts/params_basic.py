#!/usr/bin/env python
"""Parameters of every type, set, read, asked for, deleted."""

import rospy

rospy.init_node("setter")
values = {
    "an_int": 5,
    "negative": -7,
    "a_float": 2.5,
    "whole_float": 3.0,
    "yes": True,
    "no": False,
    "text": "hello world",
    "empty": "",
    "unicode": "gr\u00fc\u00dfe",
    "a_list": [1, 2.5, "x", True],
    "nested": [[1, 2], [3, 4]],
    "empty_list": [],
    "a_dict": {"p": 1, "i": 0.5, "d": {"x": "y"}},
    "a_tuple": (1, 2),
}
for key in sorted(values):
    rospy.set_param("~" + key, values[key])
for key in sorted(values):
    got = rospy.get_param("~" + key)
    print(key, type(got).__name__, got)
print(sorted(rospy.get_param("~").items(), key=lambda pair: pair[0]))
print(rospy.has_param("~text"), rospy.has_param("text"), rospy.has_param("/setter/text"))
print(rospy.get_param("~a_dict/d"), rospy.get_param("~a_dict/d/x"), rospy.get_param("/setter/a_dict/p"))
rospy.delete_param("~a_dict/d/x")
print(rospy.get_param("~a_dict"))
rospy.delete_param("~a_dict")
print(rospy.has_param("~a_dict"), rospy.get_param("~a_dict", "default"), rospy.get_param("~a_dict", None))
rospy.set_param("~text", {"deep": {"deeper": 1}})
rospy.set_param("~text/deep/beside", 2)
print(rospy.get_param("~text"))
rospy.set_param("~text/deep", {"only": 1})
print(rospy.get_param("~text"))
rospy.set_param("~an_int/below", 1)
print(rospy.get_param("~an_int"))
print(sorted(name for name in rospy.get_param_names() if name.startswith("/setter")))
