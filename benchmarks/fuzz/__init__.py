"""Hostile input for every reader: `python -m benchmarks.fuzz`, see docs/security.md."""
