#!/usr/bin/env python
"""Reads, sets, searches and deletes parameters in rospy's manner and in rosparam's."""

import rosparam
import rospy

rospy.init_node("test_params")
print(
    "Int: %s, Float: %s, String: %s"
    % tuple(rospy.get_param(name) for name in ("/my_integer", "/my_float", "/my_string"))
)
rospy.set_param("/another_integer", 12)
print(rospy.get_param("/another_integer"), rospy.get_param("/nothing", "this is a default value"))
for module in (rospy, rosparam):
    quote = repr if module is rosparam else lambda value: value
    module.set_param(rospy.resolve_name("list_of_floats"), quote([1.0, 2.0, 3.0, 4.0]))
    module.set_param(rospy.resolve_name("bool_True"), "true" if module is rosparam else True)
    module.set_param(rospy.resolve_name("~private_int"), quote(2))
    module.set_param(rospy.resolve_name("gains"), quote({"p": 1, "i": 2, "d": 3}))
    print(rospy.get_param("gains/p"), rospy.get_param("list_of_floats"), rospy.get_param("bool_True"))
    print(rospy.get_param("~private_int"), sorted(rospy.get_param("gains").items()))
if rospy.has_param("gains/d"):
    rospy.delete_param("gains/d")
try:
    rospy.delete_param("gains/d")
except KeyError:
    print("value not set")
print("/another_integer" in rospy.get_param_names())
rospy.set_param("/global_example", "top")
print(rospy.search_param("global_example"), rospy.get_param(rospy.search_param("global_example")))
rospy.set_param("~global_example", "own")
print(rospy.search_param("global_example"))
