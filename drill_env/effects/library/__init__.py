"""The effects that come with the package: one file each, found by being here."""
