"""Initial conditions: consistent first positions and velocities."""
