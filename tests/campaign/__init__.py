"""A campaign that hunts for silent errors: random mechanisms and analyses, independent truth.

``python -m tests.campaign --count 100000`` is the long form (`make campaign`), the short one is
``tests/campaign/test_campaign.py``. A disagreement without a doubt, a note or an error is a silent
error; it is written as a model file with its seed. ``validation/campaign.md`` has the counts of the
last long run.
"""
