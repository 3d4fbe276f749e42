"""Random rigs with random effects: does the integrator fail, hang or lie?"""
