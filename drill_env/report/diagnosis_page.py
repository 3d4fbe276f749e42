"""The page of a diagnosis (being written)."""
def diagnosis_page(found):  # noqa
    return "<html></html>"
