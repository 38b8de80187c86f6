"""Descriptions by the user: mechanism, bodies, joints, loads, drivers, couplings, events,
studies.
"""
