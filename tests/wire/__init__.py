"""What happens on a real link: split reads, lost bytes, dying devices, killed hosts?"""
