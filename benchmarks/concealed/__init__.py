"""Cases with concealed physics: made without the package, answered by it, scored afterwards."""
