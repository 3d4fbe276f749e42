"""Learning agents for the drill-string environments."""
