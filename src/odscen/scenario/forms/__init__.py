"""The forms of a scenario: graph form, and telling it from the document."""
