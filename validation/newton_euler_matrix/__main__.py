"""``python -m validation.newton_euler_matrix``: the equations with numbers."""

from validation.newton_euler_matrix import sheet
from validation.norton_fourbar.newton_euler import MASS

if __name__ == "__main__":
    print("\n\n".join(sheet(masses) for masses in MASS))
