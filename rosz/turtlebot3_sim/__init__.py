"""A small TurtleBot3 on a flat floor, with a laser and obstacles.

`world` is pure geometry; `simulator` is the node and the program.
"""
