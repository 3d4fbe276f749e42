"""The effects that come with the package, each one declaration, found by being here."""
