"""Tests of rosz.images."""
