#!/usr/bin/env python3
"""Drive a robot with keys."""

from rosz.programs.teleop_twist_keyboard import main

main()
