"""Tests of the form of the source: floors, doors, words, sizes, types."""
