"""Reports: the engineer's document of a mechanism, as a page, Markdown, LaTeX or PDF.

>>> import mbody
>>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=10.0)
>>> mbody.report(machine, ["joints", "checks"])
MechanismReport('four-bar': 2 chapters, completed)

`chapters` is the template: each chapter is made of plain `blocks`, which every format writes.
"""
