"""Messages between two nodes: of one process, and of two."""
