"""Reports: the engineer's document of a mechanism, as a page, Markdown, LaTeX or PDF.

`contents` and its neighbours make a `document` of plain blocks; each format writes the same blocks.
"""
