"""How fast is it? Scripts that measure and print; nothing here asserts a time."""
