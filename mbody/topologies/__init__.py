"""Linkages of any topology as arrays: their motion and forces, random ones, data sets of them."""
