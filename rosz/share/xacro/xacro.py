#!/usr/bin/env python3
"""Expand a xacro file."""

from rosz.ros1.tools.xacro import main

main()
