"""The ``rosz`` command: one file per group, each of which parses, calls the library and prints."""
