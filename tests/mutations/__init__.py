"""What do damaged, hostile and mistaken files do to the command line? Files of every kind the program opens."""
