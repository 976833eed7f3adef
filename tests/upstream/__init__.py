"""Reports for other projects: programs that show a fault with that project alone."""
