"""Hostile input for every reader, and random rigs with random effects for the integrator.

`python -m benchmarks.fuzz`, see docs/security.md, and `python -m benchmarks.fuzz.rigs`, see
docs/integrator.md.
"""
