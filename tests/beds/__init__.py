"""Fixtures and data that several tests use."""
