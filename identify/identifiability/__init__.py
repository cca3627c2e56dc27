"""What recordings cannot tell, found in their sensitivities and said in words."""
