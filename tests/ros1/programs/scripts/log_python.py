#!/usr/bin/env python
"""The loggers of Python beside those of rospy."""

import logging

import rospy

mine = logging.getLogger("mine")
mine.setLevel(logging.INFO)
handler = logging.StreamHandler()
handler.setFormatter(logging.Formatter("mine: %(message)s"))
mine.addHandler(handler)
mine.info("before")
rospy.init_node("loggers")
mine.warning("after")
logging.getLogger("rosout").info("to rosout")
logging.getLogger("rosout.part").warning("to a part of rosout")
print(logging.getLogger("rosout").name, logging.getLogger("rosout").isEnabledFor(logging.INFO))
