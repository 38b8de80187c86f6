"""A campaign that hunts for silent errors: what is drawn at random, and independent truth.

``python -m tests.campaign SUBJECT --count 100000`` is the long form (`make campaign`), the short
ones are tests in this folder and in ``tests/invariance``. Subjects: "mechanisms", "scenes" of
bodies that touch, what is "held" by contacts, "invariance" under units and frames. A disagreement
without a doubt, a note or an error is a silent error; it is written as a model file with its seed.
``validation/campaign.md`` has the counts of the last long run.
"""
