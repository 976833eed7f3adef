#!/usr/bin/env python3
import rospy
import a_module_that_nobody_has
