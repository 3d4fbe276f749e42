"""Parameters of the rig and the files that hold them."""

from drill_env.parameters.rig import SYMBOLS, Rig
from drill_env.parameters.rig_file import dump_rig, load_rig, save_rig

__all__ = ["SYMBOLS", "Rig", "dump_rig", "load_rig", "save_rig"]
