"""Classical controllers that learning agents are measured against."""
