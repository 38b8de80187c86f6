"""What a first answer loads and goes through, in a process of its own: `python -m` this.

Modules of mbody in `sys.modules` after the answer, the lines of their sources, and, with
MBODY_CORE=plain, the files of which a function is called on the way.
"""

import json
import os
import subprocess
import sys

from tests.support.paths import ROOT

#: Programs of a first answer; with few instants, so that plain Python takes no time.
ANSWERS = {
    "a four-bar": "mbody.kinetostatics(mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, "
    "masses=(1.0, 3.0, 2.0), speed=10.0), turn=True, instants=5)",
    "a four-bar's file": "mbody.kinetostatics(mbody.gallery.load('norton_fourbar'), turn=True, "
    "instants=5)",
    "a pendulum's file": "mbody.simulate(mbody.gallery.load('simple_pendulum'), 0.05)",
}


def count(answer):
    """{"modules": …, "lines": …, "walked": …}: two lists and a number, of plain Python."""
    settings = {**os.environ, "MBODY_CORE": "plain"}
    settings["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), os.getenv("PYTHONPATH"))))
    command = [sys.executable, "-m", "tests.work_counts.start", answer]
    done = subprocess.run(command, env=settings, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout)


def _counted(answer):
    import mbody

    folder, walked = os.path.dirname(mbody.__file__) + os.sep, set()

    def called(frame, event, _):
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(folder):
            return
        # what runs while a module loads, as decorators, is no part of the way
        above = frame
        while above is not None:
            inside = above.f_code.co_filename.startswith(folder)
            if inside and above.f_code.co_name == "<module>":
                return
            above = above.f_back
        walked.add(code.co_filename)

    sys.setprofile(called)
    exec(ANSWERS[answer], {"mbody": mbody})
    sys.setprofile(None)
    modules = {name: one for name, one in sys.modules.items() if name.partition(".")[0] == "mbody"}
    lines = 0
    for one in modules.values():
        with open(one.__file__, encoding="utf-8") as source:
            lines += sum(1 for _ in source)
    files = [name.removeprefix(folder) for name in walked]
    return {"modules": sorted(modules), "lines": lines, "walked": sorted(files)}


if __name__ == "__main__":
    if sys.argv[1:]:
        print(json.dumps(_counted(sys.argv[1])))
    else:
        for name in ANSWERS:
            found = count(name)
            print(
                f"{name}: {len(found['modules'])} modules, {found['lines']} lines, "
                f"through {len(found['walked'])} files"
            )
