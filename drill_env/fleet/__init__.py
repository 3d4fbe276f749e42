"""Many rigs: each diagnosed from its folder of recordings, all in one table."""

from drill_env.fleet.run import Fleet, run_fleet
from drill_env.fleet.settings import FleetSettings

__all__ = ["Fleet", "FleetSettings", "run_fleet"]
