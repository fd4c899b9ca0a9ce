"""The scenario document, its graph form, edits, checks and sampling."""
