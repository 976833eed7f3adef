#!/usr/bin/env python3
"""Expand a xacro file."""

from rosz.programs.xacro import main

main()
