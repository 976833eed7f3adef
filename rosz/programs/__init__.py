"""The programs of ROS 1 packages that rosz ships, written on `rosz.node`.

Each module is one program or the programs of one package; the files in ``rosz/share`` only call
them. They are public modules, because each is loaded alone. May import everything below the command
line.
"""

PUBLIC_MODULES = ("tf",)
