"""Does a cable tell what the device at its ends does?"""
