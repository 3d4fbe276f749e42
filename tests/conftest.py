"""Tests that run side by side keep to one processor each: more threads only wait for each other."""

import os

from drill_env import _threads

if "PYTEST_XDIST_WORKER" in os.environ:
    _threads.PROCESSORS = 1
