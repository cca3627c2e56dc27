"""Recordings whose truth is sealed, and what the tool said of them, once and unedited."""
