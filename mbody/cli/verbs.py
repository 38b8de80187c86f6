"""The verbs of the command: the functions behind them, and the options that are their arguments.

Texts that are left out are those of the docstrings, so that each is written once. `VERBS` has

= words              a group of verbs, for the list of all
@name title          arguments that several verbs have, below their title
name answer […]: …   a verb, the function in `mbody.cli` that answers, and the Python functions that
                     it offers; then a few words. Below it
    @name …          arguments that several have
    $ words          an example
    not names: why   arguments of Python that a command has no option for
    --option …: …    an argument, see below

An argument has its names, the name of its value (a switch has none), and maybe {…}, which values
there are; ... may be given again; ! must be given; ? or * may be left out; + one or more; =… by
default; ->… its name in the function that answers; (…) which arguments of Python it gives, if not
those of its name. Lines that are indented by eight more go on with the one above.
"""

VERBS = """\
@model Model
    MODEL (model,mechanism,run,solution,make): a model file (TOML, or JSON by its ending), or the
        name of a gallery model
    --set NAME=VALUE ...: another value for a parameter of the model or a number of an element, such
        as --set 'load=12 lbf' or --set crank.A.x=30
    --units UNITS: of the results: SI, mm-N-s, in-lbf-s, ft-lbf-s …, or of quantities, as
        mass=kg,power=W, or both: SI,power=kW
    not progress: a terminal shows it
@instants Instants
    --at NAME=VALUE ... (at,t,drive,options,instant): position of a driver or its body (crank=60, in
        degrees; rates by its law), or t=0.1; several values with commas, or in equal steps as
        crank=0:360:25
    --over WHAT (over,turn,options): a whole turn: 'turn', or which driver is to make it
    --instants N (instants,options): how many of a turn, both ends included (361)
    --turns N (turns,options): how many whole turns (1), 2 of a four-stroke engine
    not guess: bodies of the model have it, and --assembly says which mode
@assembly Instants
    --assembly MODE: the assembly mode at the first instant, by its name or number in mbody
        assemblies, such as open
@free Instants
    --to TIME (to,until): of the free motion until that time, such as 10 or '2 min'
@angle Output
    --angle {deg,rad}: unit of angles, without it deg in --json and rad in --csv
@json Output
    --json: print data instead of text
@excel Output
    --excel: mark the file of --csv, so that spreadsheets show its units rightly
@tables Output
    --csv FILE <table>: write all histories as a table; - prints it
    @excel
    --npz FILE: write all histories as NumPy arrays
    --xlsx FILE: write a spreadsheet: instants, peaks and the model
    -o --output FILE: any of these, .json or .parquet, by the ending of the file
@analysis Instants
    --analysis NAME =kinetostatics: kinetostatics (default), kinematics, statics
@driven
    @model @instants @assembly
@forces
    --equations: print the system of equations with its numbers
    --efficiency OUTPUT: work given, useful on that load or driver, and lost in joints
@moving
    @driven
    --to TIME: the last time, such as 10 or '2 min'
    --vary NAME=LOW:HIGH:COUNT ...: designs that are shown with one another, or NAME=1,2,3
    --show WHAT: with commas: names, forces, velocities, accelerations, paths, centres, ghosts
    --path POINT ... (paths): draw the path of a point, such as coupler.P
= solve
kinetostatics analyse.analyse analysis.driven.driven.kinetostatics: motion, all joint forces
    $ kinetostatics norton_fourbar
    $ kinetostatics mine.toml --at crank=0:330:12
    $ kinetostatics mine.toml --over turn --csv turn.csv
    @driven @forces @angle @json @tables
kinematics analyse.analyse analysis.driven.driven.kinematics: positions and their rates
    $ kinematics mine.toml --at crank=60
    @driven @angle @json @tables
statics analyse.analyse analysis.driven.driven.statics: forces at rest
    $ statics mine.toml --set load=120 --json
    @driven @forces @angle @json @tables
simulate analyse.simulate analysis.dynamics.simulate.simulate: free motion over time
    $ simulate mine.toml --to 10 --csv run.csv
    @model
    --to TIME (until): the last time, such as 10 or '2 min'
    --method NAME: dop853 (default), dopri5, radau5 (stiff), generalized-alpha, rattle, rattle4,
        moreau (many contacts)
    --rtol R: error of a step, as a part (1e-8)
    --atol R: the same of what is near 0, as a part of the model's size (--rtol)
    --step H
    --instants N
    --every DT
    --times T ...: or which ones, with commas or as LOW:HIGH:COUNT
    --guess BODY=ANGLE ...: where a body begins, such as arm=90, in degrees
    --rates BODY=RATE ...: angular velocity with which it begins, such as 'arm=30 rpm'
    --release NAME=TIME ...: when a driver is released: from then on it has no effort
    --input NAME=VALUE ... (inputs): history of an input: '2 N*m', '3 N*m*sin(2 rad/s*t)' or
        @FILE.csv with columns t and u
    --from FILE ->begun (start): go on from a saved result
    --save FILE: keep the whole result, to go on from
    not events: the model has them in [simulate]
    @angle @json @tables
equilibrium analyse.equilibrium analysis.equilibria.equilibrium.equilibrium: where it rests
    $ equilibrium mine.toml --free motor
    @model
    --free DRIVER ...
    --guess BODY=ANGLE ... (starts): where the search begins besides, such as arm=180, in degrees
    --t TIME
    @angle @json
modes analyse.modes analysis.linear.modes.modes: frequencies and shapes
    $ modes mine.toml
    @model
    --free DRIVER ...
    --guess BODY=ANGLE ... (starts): where the search for rest begins besides
    --t TIME: when laws are evaluated (0)
    not at: all equilibria are found
    @json
solve design.solve inverse.solve_for.solve_for: unknowns that meet conditions
    $ solve mine.toml brake
    @model
    name NAME ?: one question [solve.NAME] of the model; all without it
    --unknowns NAMES: what is to be found, with commas, in place of the questions of the file
    --conditions EQUATION ...: such as 'motor.effort = 0'
    --side-conditions RELATION ...: such as 'road.fy >= 0'
    --greatest QUANTITY: it is to be as great as the side conditions let it be
    --least QUANTITY: the same, as small
    --analysis NAME: kinetostatics (default), or statics for rest
    --at NAME=VALUE ...: the one position of a driver (crank=60, in degrees), or t=0.1
    @angle @json
= examine
check analyse.check analysis.freedom.mobility.mobility: degrees of freedom
    $ check mine.toml
    @model
    --t TIME
    not guess: bodies of the model have it
    @json
assemblies analyse.assemblies analysis.assemblies.assembly_modes.assembly_modes
        analysis.assemblies.circuits.circuits: all ways in which it closes
    $ assemblies mine.toml --at crank=60
    @model
    --at NAME=VALUE ... (drive): position of a driver or its body (crank=60, in degrees), or t=0.1
    --driver NAME
    --most N
    -o --output FILE: draw all of them; ends in .svg, .png or .pdf
    not used: it is the position that the model has
    @angle @json
transmission analyse.transmission analysis.driven.transmission.transmission: angle and advantage
    $ transmission mine.toml --output rocker
    @model
    --output BODY !
    --driver NAME
    --joint NAME
    @instants @assembly @angle @json
poles pictures.poles engineering.instant_centres.instant_centres: instant centres
    $ poles mine.toml --at crank=60
    @driven @free @angle @json
internal pictures.internal engineering.internal_loads.internal_loads: bending moment and stress
    $ internal mine.toml --body rod --over turn -o rod.svg
    @model
    --body LINK !
    --along A,B
    --places N
    --lumped
    @free
    -o --output FILE: draw the diagrams; ends in .svg, .png or .pdf
    @instants @assembly @json
crosscheck analyse.crosscheck engines.crosscheck.crosscheck: results of other engines
    $ crosscheck mine.toml --against pinocchio
    @model
    --against ENGINES: which, such as pinocchio,pymunk; by default all that are installed
    not ours: it is the analysis of the model
    @json
= machines
cam learn.cam engineering.cam_limits.cam_analysis: pressure angle, contour
    $ cam mine.toml --limit 30 --csv contour.csv
    @model
    --joint NAME
    --limit ANGLE: of the pressure angle, such as 30: the base radius that it needs is found
    --points N: how many of the contour, both ends included (361)
    --csv FILE <table>: write contour, pitch curve and radius of curvature; - prints them
    @excel @instants @assembly @angle @json
balance design.balance engineering.force_balance.force_balance
        engineering.force_balance.spring_balance: counterweights, springs
    $ balance mine.toml --on 'crank=3 in' -o balanced.toml
    @model
    --on LINK=RADIUS ...: a link that gets a counterweight, such as 'crank=3 in', or from a point of
        it, 'rocker.O4=5 in'
    --springs NAMES: springs of the model whose stiffnesses are found, with commas
    --against NAMES
    @instants
    -o --output FILE <model>: write the balanced model (.toml), new numbers to six digits
    @json
shaking learn.shaking engineering.shaking.shaking_orders engineering.shaking.balance_shafts:
        shaking force by order
    $ shaking mine.toml --turns 2 --shafts 1,2
    @model
    --about PLACE =ground
    --driver NAME
    --orders ORDER (highest): the last order (8)
    --shafts ORDERS (orders): balance shafts for these orders, with commas: 1,2
    @instants @assembly @angle @json
flywheel learn.flywheel engineering.flywheel.size_flywheel: for a steady speed
    $ flywheel mine.toml --coefficient 0.02
    @model
    --coefficient R !
    --driver NAME
    --simulate: prove it by the free motion with that flywheel
    @instants @assembly @angle @json
motor learn.motor engineering.motor_sizing.motor_sizing: a motor and its gear
    $ motor mine.toml --speed '0 rpm,3000 rpm' --peak '6 N*m,5 N*m' --continuous '2 N*m,1.6 N*m'
    @model
    --speed SPEEDS ! (motor): of its curve, such as '0 rpm,3000 rpm'
    --peak TORQUES ! (motor): greatest torques at these speeds, such as '6 N*m,5 N*m'
    --continuous TORQUES ! (motor): torques that may last, at the same speeds
    --inertia J =0 (motor): of its rotor (0)
    --driver NAME
    --ratio R
    --efficiency R
    --rest TIME
    @instants @assembly @json
bearings learn.bearings engineering.internal_loads.bearing_load: loads and lives
    $ bearings mine.toml --rating 'A=12 kN'
    @model
    --joint NAMES: revolute joints, with commas; all without it
    --kind KIND =ball: ball (default), roller, or the exponent of life itself
    --rating NAME=C ...
    --spectrum N: print the load spectra too, in so many classes of force
    @free @instants @assembly @json
= design
sweep design.sweep sweeps.run.sweep: one analysis, many designs
    $ sweep mine.toml --vary load=1:9:50 --measure 'peak(A.force)'
    @model
    --vary NAME=LOW:HIGH:COUNT ... (parameters): a number that differs between designs, or
        NAME=1,2,3; several make a grid
    --measure FORMULA ...: what is measured of each, such as 'peak(A.force)'; by default the model's
        measures
    --analysis NAME =kinetostatics
    @instants
    --to FOLDER: keep the answers there, to be continued later
    --threads N
    --scheduler ADDRESS
    --csv FILE <table>: write a line for each design; - prints it
    @excel @angle @json
sensitivity design.sensitivity derivatives.gradient.gradient: which number changes most
    $ sensitivity mine.toml 'peak(A.force)' --over turn
    @model
    measure MEASURE: a measure or a formula, such as 'peak(A.force)'
    --by NAMES
    @analysis @instants @angle @json
optimize design.optimize optimization.optimize.optimize: best numbers within limits
    $ optimize mine.toml --minimize 'peak(motor.effort)' --by crank.A.x=30:50 --over turn
    @model
    name NAME ? (task): one task [optimize.NAME] of the model; all without it
    --minimize FORMULA ...: a quantity, such as 'peak(A.force)', in place of the tasks of the file;
        twice: a front
    --maximize FORMULA ...: the same, greatest
    --by NAME=LOW:HIGH ...: a number and its bounds, such as 'crank.A.x=30 mm:50 mm'
    --subject-to RELATION ...: a limit at all instants, such as 'peak(motor.effort) <= 20 N*m'
    --analysis NAME
    --over WHAT (options): a whole turn: 'turn', or which driver is to make it
    --instants N (options): how many of a turn, or of the motion
    --turns N (options): of a cycle of several turns, with --over
    --until TIME (options): of simulate: the last time
    --start NAME=VALUE ...
    --starts N
    --points N
    --seed N
    -o --output FILE <model>: write the best model (.toml)
    --csv FILE <table>: write the numbers as a table; - prints it
    not loss: the part that a band may cost stays as it is
    @excel @json
tolerances design.tolerances derivatives.tolerance_study.tolerances: bands of what scatters
    $ tolerances mine.toml 'peak(A.force)' --over turn --scatter 'crank.A.x=0.1 mm'
    @model
    measure MEASURE: a measure or a formula that is one number, such as 'peak(A.force)'
    --scatter NAME=WIDTH ...: a number and its tolerance ±, three deviations of a normal
        distribution, such as 'crank.A.x=0.1 mm', or 'uniform 0.1 mm', 'triangular 0.1 mm'
    --within LOW:HIGH: the band in which it must stay: the loosest tolerances are found
    --cost NAME=C ...
    --count N
    --seed N
    @analysis @instants @angle @json
fit design.fit derivatives.fit.fit: numbers from measurements
    $ fit mine.toml run.csv --by crank.A.x,rod.mass
    @model
    data DATA +: CSV files of measured runs, with headings: t or the drivers, then measures or
        formulas, with a unit in brackets, as in 'slider.x [mm]'
    --by NAMES: the unknown numbers, such as crank.A.x, with commas; by default those of [fit]
    --offset NAMES ->offsets
    --deviations NAME=VALUE ...
    --confidence R
    --analysis NAME
    not options: the instants are in the data
    @json
synthesize design.synthesize synthesis.request.synthesize: for a path, function, poses
    $ synthesize path.csv -o design.toml
    points FILE (path,function,poses,timing): a table (CSV) with columns x, y and maybe timing: a
        path; x, y, angle: poses; input, output: a function; plain angles are in degrees
    --kind KIND
    --model MODEL
    --point NAME (of)
    --span LOW:HIGH
    --by NAME=LOW:HIGH ...
    --subject-to CONDITION ...
    --units UNITS
    --ground LENGTH
    --tolerance LENGTH
    --atlas FILE
    --full-turn: the crank must turn round
    --defective: keep designs with defects too
    --count N
    --search N: how many designs are tried for a path
    --starts N: how many of the best are refined
    --seed N
    -o --output FILE <model>: where the designs are written: design.toml, design-2.toml, …
    @json
cognates design.cognates synthesis.coupler_cognates.cognates: same coupler curve
    $ cognates mine.toml --point coupler.P
    @model
    --point NAME !
    -o --output FILE <model>: where the cognates are written: cognate.toml, cognate-2.toml
    @json
atlas design.atlas synthesis.linkages.Atlas.made: coupler curves to begin with
    $ atlas --to atlas.npz
    --to FILE !: where it is written
    --kind KIND: four_bar (default) or slider_crank
    --count N: how many curves (4000)
    --seed N: of the random shapes (0)
linkages design.linkages topologies.dataset.write_linkages topologies.dataset.LinkageSet: data
        of random linkages
    $ linkages --count 5000 --to folder
    --to FOLDER ! (folder): goes on where one is begun
    --count N (what,count): how many linkages (1000)
    --nodes N: joints of each (8)
    --seed N: of the random numbers (0)
    --instants N: positions of each (200)
    --groups NAMES: of dyads,sliders,triads,assur, by default all
    --turn R: turn of the crank [deg] (360)
    --speed R: of the crank [rad/s] (1)
    --threads N: by default as many as there are cores
    --scheduler ADDRESS: of a Dask cluster, such as tcp://10.0.0.5:8786
    --part K/N: the K-th of N parts, each a process of its own (1/1)
    not gravity progress: it is that of the earth; a terminal shows how far it is
= show
edit board.edit: a board to draw and drag on
    $ edit mine.toml
    MODEL ?: a model file (TOML) in or below this folder, one that is to be, or the name of a
        gallery model; an empty page without it
    --port N: a port of this machine, by default one that is free
    --no-open: print the address of the page and open no browser
    --keep: go on without the page, until Ctrl-C; without it the end is a minute after the page
draw pictures.draw views.drawing.draw: a picture with its forces
    $ draw mine.toml --forces -o mine.svg
    @driven
    --forces: draw the joint forces too
    --path POINT ... (paths): draw the path of a point, such as coupler.P
    @free
    --positions N (instant): N equal steps of the turn or of the motion
    --strip: several positions beside each other, not overlaid
    --series: a file for each position, at one scale
    --only BODIES: draw only these links, with commas between them
    --poles: draw all instant centres, and the lines to find them
    --polygons: the velocity and the acceleration polygon beside
    --centrodes BODIES: the fixed and the moving centrode of bodies against the ground
    --inflection BODIES: inflection circles of bodies
    --curvature POINT ...: the path of a point and its circle of curvature
    -o --output FILE: ends in .svg, .png or .pdf (MODEL.svg)
plot pictures.plot views.plotting.plot views.plotting.polar views.plotting.hodograph
        views.plotting.path_plot: curves over the cycle
    $ plot mine.toml motor.effort 'B.force [kN]' -o effort.png
    @model
    quantities QUANTITY *: a measure of the model, or a formula such as motor.effort, B.force,
        coupler.P.y; without any, all measures; a unit in brackets behind it, as in 'B.force
        [kN]'
    @instants @assembly @free
    --x QUANTITY: what it is plotted over
    --log AXES
    --no-modes (modes): without the bars that say what is open, sticks, slides or rolls
    --vary NAME=LOW:HIGH:COUNT ...: several designs, overlaid; more than six are a band
    --polar JOINTS (joints): magnitudes of joint forces over the angle of the crank
    --hodograph JOINTS (joints): the curves of the tips of joint forces
    --path POINT ... (points): the path of a point, y over x
    --axes BODY: the link in whose axes a hodograph is
    -o --output FILE: ends in .svg, .png or .pdf (MODEL-plot.svg)
    not labels: --vary makes them
view pictures.view views.page.view: a page on which it moves
    $ view norton_fourbar --open
    @moving
    --plot QUANTITY ... (plots): a diagram of a measure or a formula, such as B.force; by default
        the measures
    --live: the page solves the model again while one drags and changes it; builds the core for
        browsers where it is missing (once)
    or --recorded: the page plays the recorded motion only
    --open: open the page in the browser
    -o --output FILE: ends in .html (MODEL.html by default), or in .json for the web component
    not command: it is the one that was given
animate pictures.animate views.film.animate: a film of it
    $ animate mine.toml -o mine.gif
    @moving
    --duration R
    --rate R
    --width N
    -o --output FILE (path): ends in .gif (MODEL.gif by default), .webp, .apng, .svg or .mp4
freebody pictures.freebody views.free_bodies.draw_free_bodies: every link with its forces
    $ freebody mine.toml --at crank=60
    @driven @free
    --bodies NAMES: which links, with commas between them; by default all
    -o --output FILE: ends in .svg, .png or .pdf (MODEL-freebody.svg)
    not headed instants: each has its heading; --at names positions
report pictures.report reports.mechanism_report.report: the engineer's document
    $ report mine.toml -o mine.html
    @driven @free
    --sections NAMES: what it contains, in order, with commas; by default everything
    --without NAMES
    --plot QUANTITY ... (plots): what is plotted; by default efforts, forces and measures
    --polar JOINTS: whose forces are drawn as vectors
    --against ENGINES: of the cross-check; by default all that are installed
    --compare NAME=VALUE ...: another design, beside this one, as of --set
    --title TEXT
    --author TEXT
    --open: open it in the browser
    -o --output FILE: ends in .html, .md, .tex or .pdf (MODEL.html)
    not labels command: --set and --compare are the labels, and the command is the one given
    not instants: links are drawn at the positions of the model, or at the greatest force
= teach
demo learn.demo: a textbook four-bar
    $ demo
derive learn.derive teaching.derivation.derivation_as: equations with numbers
    $ derive mine.toml --at crank=60
    @driven @free
    --form {text,markdown,latex} =text: how it is written
    -o --output FILE <text>: by default it is printed
exercise learn.exercise teaching.exercises.exercises: questions and a key
    $ exercise mine.toml --vary a=40:60 --count 30 --seed 7 --key key.md > sheet.md
    @model
    --vary NAME=LOW:HIGH ...: a number that differs between exercises
    --count N
    --seed N
    --key FILE: write the worked solutions (Markdown)
    -o --output FILE <text>: by default the sheet is printed
explain learn.explain teaching.exercises.element_reference: an element, by example
    $ explain spring
    element ELEMENT ? (name): such as spring or hinge; all kinds without it
= files
new learn.new teaching.exercises.new_model: a model to begin with
    $ new fourbar --lengths 40,120,80,100
    kind KIND ?: fourbar, slidercrank, sixbar, gears, cam or pendulum; all kinds without it
    --lengths LENGTHS: all of its lengths, with commas
    --units UNITS: of plain numbers and of the results: mm-N-s (default), SI, in-lbf-s …
    -o --output FILE: KIND.toml by default; - prints it
models analyse.models: those of the gallery
    @json
show analyse.show: a model's file
    $ show norton_fourbar > mine.toml
    MODEL: a model file (TOML, or JSON by its ending), or the name of a gallery model
import pictures.import_file exchange.recognition.import_model: from another program
    $ import linkage.linkage2 -o mine.toml
    file FILE: of PMKS (text, .pmks or an address), Linkage (.linkage2), pylinkage (JSON), MuJoCo
        (MJCF) or a URDF: recognised by what is in it
    --units UNITS
    -o --output FILE <text>: by default it is printed
export pictures.export engines.mjcf.to_mjcf exchange.dxf.to_dxf image.model_image.to_image
        image.fmu.to_fmu: to MuJoCo, FMU, DXF, an image
    $ export mine.toml --to fmu -o mine.fmu
    @model
    --to {mjcf,dxf,image,fmu} !: mjcf: model files of MuJoCo, in SI units; dxf: links and contours
        of cams, for CAD; image: bytes on which the compiled core runs without Python; fmu: a
        unit of co-simulation, in SI units and rad; builds its binaries where they are missing
        (once)
    --width LENGTH: of bars in a drawing, such as '20 mm'
    --hole LENGTH: diameter of holes in a drawing
    --fix-drivers
    --fmi {3.0,2.0} (version): the version of FMI of a unit (3.0)
    --analyses NAMES: of an image: driven, free or both
    --instants N: how many of a turn (361) and of a free motion in an image
    -o --output FILE <text> (name): by default text is printed
    not start smooth binaries: the pose is that of the model; the cross-check has them
schema analyse.schema: JSON Schema of model files
= machine
doctor compile.doctor: what is installed and works
    @json
warmup compile.warmup: compile all kernels, once
compile compile.compile_libraries: libraries for C, browsers
    $ compile --target wasm32 -o mbody.wasm
    --target NAME ...: host (default), x86-64-v2, x86-64-v3, x86-64-v4, aarch64, windows, macos; the
        first decides how the kernels are optimised; wasm32: for browsers
    --images: an object file of the kernels that images call, for C programs to link
    or --fmu: the binary of co-simulation units (FMI 2.0 and 3.0), one for all models
    -o --out FOLDER =.: where they go; for wasm32 a file, too
"""
