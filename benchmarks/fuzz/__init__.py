"""Hostile input for every reader, random rigs and environments, killed commands, odd places.

`python -m benchmarks.fuzz`, `.environments`, `.killed` and `.places`, see docs/security.md, and
`python -m benchmarks.fuzz.rigs`, see docs/integrator.md.
"""
