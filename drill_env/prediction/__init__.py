"""Which physics is missing, decided by the prediction of recordings that were not fitted."""
