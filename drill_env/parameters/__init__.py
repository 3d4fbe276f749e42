"""Parameters of the rig, the files that hold them and their uncertainty."""

from drill_env.parameters.rig import SYMBOLS, Rig
from drill_env.parameters.rig_file import dump_rig, load_rig, save_rig
from drill_env.parameters.uncertainty import UNCERTAINTY, Level, Uncertainty, perturb, uncertainty

__all__ = [
    "SYMBOLS",
    "UNCERTAINTY",
    "Level",
    "Rig",
    "Uncertainty",
    "dump_rig",
    "load_rig",
    "perturb",
    "save_rig",
    "uncertainty",
]
