"""Language of the kernels, and the core that runs them; nothing here imports a compiler."""
