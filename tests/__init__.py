"""Everything that can fail before a user does."""
