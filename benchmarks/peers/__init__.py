"""One small adapter per peer: the paper's rig at constant voltage from rest."""
