"""What does somebody see who looks at a recording or an answer in a notebook?"""
