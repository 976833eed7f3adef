"""Tests of several nodes in one process."""
