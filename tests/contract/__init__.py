"""Does every member of an extension point keep its contract?"""
