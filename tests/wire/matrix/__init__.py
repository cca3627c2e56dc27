"""Does every fault of every link end in a correct recording or a clear error, with the output safe?"""
