"""What kernels are written with, and which core runs them; nothing here imports a compiler."""
