"""Small motions: linearised equations, modes, eigenvalues."""
