"""What a user describes: mechanism, bodies, joints, loads, drivers, couplings, events, studies."""
