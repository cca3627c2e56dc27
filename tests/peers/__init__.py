"""Do public libraries that know a part of this rig say the same as we do?"""
