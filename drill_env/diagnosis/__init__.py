"""The detective: what a rig's model leaves out of recordings."""
