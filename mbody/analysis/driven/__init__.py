"""Driven motion: kinematics, kinetostatics and statics along the instants of the drivers."""
