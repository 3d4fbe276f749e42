"""From recordings to rig parameters, and how well a rig replays a recording."""
