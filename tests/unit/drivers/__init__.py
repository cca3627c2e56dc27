"""Do the drivers and the emulated devices do what their protocol says?"""
