"""How is a run watched while it goes on: a page in a browser, by a process that only reads the recording?"""
