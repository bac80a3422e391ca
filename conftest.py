"""Settings of all tests, the plugins' included."""

from hypothesis import settings

# The machines that run the tests are shared: how long an example takes says nothing about the code.
settings.register_profile("estimfw", deadline=None)
settings.load_profile("estimfw")
