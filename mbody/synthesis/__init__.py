"""Dimensional synthesis: mechanisms for paths, functions and poses."""

from mbody.synthesis.coupler_cognates import Cognate, CognateList, cognates
from mbody.synthesis.judging import Design, DesignList
from mbody.synthesis.linkages import Atlas
from mbody.synthesis.request import synthesize

__all__ = ["Atlas", "Cognate", "CognateList", "Design", "DesignList", "cognates", "synthesize"]
