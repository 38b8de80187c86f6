"""Commands as they are mistyped: the name of a scenario is what was typed after mbody."""

import shlex

from mbody.cli import command

SENTENCES = r"""
forces hoekens | UsageError | - | there is no command 'forces': did you mean kinetostatics (motion, all joint forces)?
dynamics hoekens | UsageError | - | there is no command 'dynamics': did you mean simulate (free motion over time) or kinetostatics (motion, all joint forces)?
optimise hoekens | UsageError | - | there is no command 'optimise': did you mean optimize (best numbers within limits)?
optimization hoekens | UsageError | - | there is no command 'optimization': did you mean optimize (best numbers within limits)?
fbd hoekens | UsageError | - | there is no command 'fbd': did you mean freebody (every link with its forces)?
free-body hoekens | UsageError | - | there is no command 'free-body': did you mean freebody (every link with its forces)?
gallery | UsageError | - | there is no command 'gallery': did you mean models (those of the gallery)?
examples | UsageError | - | there is no command 'examples': did you mean models (those of the gallery)?
animation hoekens | UsageError | - | there is no command 'animation': did you mean animate (a film of it)?
gif hoekens | UsageError | - | there is no command 'gif': did you mean animate (a film of it)?
movie hoekens | UsageError | - | there is no command 'movie': did you mean animate (a film of it)?
inverse hoekens | UsageError | - | there is no command 'inverse': did you mean kinetostatics (motion, all joint forces) or solve (unknowns that meet conditions)?
positions hoekens | UsageError | - | there is no command 'positions': did you mean kinematics (positions and their rates)?
velocity hoekens | UsageError | - | there is no command 'velocity': did you mean kinematics (positions and their rates)?
solve-for hoekens | UsageError | - | there is no command 'solve-for': did you mean solve (unknowns that meet conditions)?
validate hoekens | UsageError | - | there is no command 'validate': did you mean check (degrees of freedom)?
dof hoekens | UsageError | - | there is no command 'dof': did you mean check (degrees of freedom)?
compare hoekens | UsageError | - | there is no command 'compare': did you mean crosscheck (results of other engines)?
eigen hoekens | UsageError | - | there is no command 'eigen': did you mean modes (frequencies and shapes)?
frequencies hoekens | UsageError | - | there is no command 'frequencies': did you mean modes (frequencies and shapes)?
sim hoekens | UsageError | - | there is no command 'sim': did you mean simulate (free motion over time)?
run hoekens | UsageError | - | there is no command 'run': did you mean simulate (free motion over time)?
fmu hoekens | UsageError | - | there is no command 'fmu': did you mean export (to MuJoCo, FMU, DXF, an image)?
mjcf hoekens | UsageError | - | there is no command 'mjcf': did you mean export (to MuJoCo, FMU, DXF, an image)?
synthesis path.csv | UsageError | - | there is no command 'synthesis': did you mean synthesize (for a path, function, poses)?
Kinematics hoekens | UsageError | - | there is no command 'Kinematics': did you mean kinematics (positions and their rates)?
kinetostatic hoekens | UsageError | - | there is no command 'kinetostatic': did you mean kinetostatics (motion, all joint forces)?
kinetosatics hoekens | UsageError | - | there is no command 'kinetosatics': did you mean kinetostatics (motion, all joint forces)?
simualte hoekens | UsageError | - | there is no command 'simualte': did you mean simulate (free motion over time)?
swep hoekens | UsageError | - | there is no command 'swep': did you mean sweep (one analysis, many designs)?
sweeps hoekens | UsageError | - | there is no command 'sweeps': did you mean sweep (one analysis, many designs)?
stress hoekens | UsageError | - | there is no command 'stress': did you mean internal (bending moment and stress)?
graph hoekens | UsageError | - | there is no command 'graph': did you mean plot (curves over the cycle)?
picture hoekens | UsageError | - | there is no command 'picture': did you mean draw (a picture with its forces)?
linearise hoekens | UsageError | - | there is no command 'linearise': did you mean modes (frequencies and shapes)?
tolerance hoekens | UsageError | - | there is no command 'tolerance': did you mean tolerances (bands of what scatters)?
monte_carlo hoekens | UsageError | - | there is no command 'monte_carlo': did you mean sweep (one analysis, many designs) or tolerances (bands of what scatters)?
counterweights hoekens | UsageError | - | there is no command 'counterweights': did you mean balance (counterweights, springs)?
branches hoekens | UsageError | - | there is no command 'branches': did you mean assemblies (all ways in which it closes)?
instant-centres hoekens | UsageError | - | there is no command 'instant-centres': did you mean poles (instant centres)?
derivation hoekens | UsageError | - | there is no command 'derivation': did you mean derive (equations with numbers)?
docs | UsageError | - | there is no command 'docs': did you mean explain (an element, by example)?
init fourbar | UsageError | - | there is no command 'init': did you mean new (a model to begin with)?
new fourbarr | ModelError | - | there is no model of the kind 'fourbarr': did you mean fourbar?
hoekens | UsageError | - | say what to do with 'hoekens', as in mbody kinetostatics hoekens (mbody --help lists all)
simple_pendulum | UsageError | - | say what to do with 'simple_pendulum', as in mbody simulate simple_pendulum (mbody --help lists all)
mine.toml | UsageError | - | say what to do with 'mine.toml', as in mbody kinetostatics mine.toml (mbody --help lists all)
other.linkage2 | UsageError | - | say what to do with 'other.linkage2', as in mbody import other.linkage2 (mbody --help lists all)
path.csv | UsageError | - | say what to do with 'path.csv', as in mbody synthesize path.csv (mbody --help lists all)
--json kinematics hoekens | UsageError | - | a command comes first, as in mbody kinetostatics MODEL --json (mbody --help lists all)
qqqqqqq hoekens | UsageError | - | there is no command 'qqqqqqq': mbody --help lists them
kinematics hoekens crank=60 | UsageError | - | 'crank=60' goes with an option: did you mean --at crank=60 or --set crank=60? (see mbody kinematics --help)
simulate simple_pendulum x=3 | UsageError | - | 'x=3' goes with an option: did you mean --set x=3? (see mbody simulate --help)
kinematics hoekens now | UsageError | - | 'now' is one word too many; quotes hold together what has spaces (see mbody kinematics --help)
kinematics hoekens -x | UsageError | - | kinematics has no option -x (see mbody kinematics --help)
kinematics hoekens --vary a=3:4:5 | UsageError | - | kinematics has no option --vary, which is of sweep, plot, view and others (see mbody kinematics --help)
kinematics hoekens --samples 12 | UsageError | - | kinematics has no option --samples: did you mean --instants? (see mbody kinematics --help)
kinematics hoekens --theta 60 | UsageError | - | kinematics has no option --theta: did you mean --at? (see mbody kinematics --help)
kinematics hoekens --param a=3 | UsageError | - | kinematics has no option --param: did you mean --set? (see mbody kinematics --help)
simulate simple_pendulum --dt 0.1 | UsageError | - | simulate has no option --dt: did you mean --every? (see mbody simulate --help)
simulate simple_pendulum --solver radau5 | UsageError | - | simulate has no option --solver: did you mean --method? (see mbody simulate --help)
simulate simple_pendulum --tol 1e-9 | UsageError | - | simulate has no option --tol: did you mean --rtol? (see mbody simulate --help)
sweep hoekens --range a=3:4:5 | UsageError | - | sweep has no option --range: did you mean --vary? (see mbody sweep --help)
optimize hoekens --constraint 'peak(A.force) <= 3' | UsageError | - | optimize has no option --constraint: did you mean --subject-to? (see mbody optimize --help)
draw hoekens --out a.svg | UsageError | - | draw has no option --out: did you mean --output? (see mbody draw --help)
check hoekens --over turn | UsageError | - | check has no option --over, which is of kinetostatics, kinematics, statics and others (see mbody check --help)
kinematics hoekens --overturn | UsageError | - | kinematics has no option --overturn: did you mean --over turn? (see mbody kinematics --help)
sensitivity hoekens 'peak(A.force)' --by a b | UsageError | - | 'b' is one word too many: --by takes one; with commas several names, or give --by again; quotes hold together what has spaces (see mbody sensitivity --help)
sweep hoekens 'a=1:2:3' | UsageError | - | 'a=1:2:3' goes with an option: did you mean --vary a=1:2:3 or --at a=1:2:3? (see mbody sweep --help)
models hoekens | UsageError | - | 'hoekens' is one word too many; quotes hold together what has spaces (see mbody models --help)
kinematics hoekens --instants | UsageError | - | argument --instants: expected one argument (see mbody kinematics --help)
sweep hoekens --threads two | UsageError | - | --threads takes a whole number, not 'two'
"""


def said(line):
    """What the command does, but for telling its errors."""
    return lambda: command._run(shlex.split(line))


SCENARIOS = {
    **{
        line.partition(" | ")[0]: said(line.partition(" | ")[0])
        for line in SENTENCES.split("\n")[1:-1]
    }
}
