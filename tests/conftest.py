from hypothesis import settings

# The first example of a test may compile a kernel: seconds, not milliseconds.
settings.register_profile("mbody", deadline=None)
settings.load_profile("mbody")
