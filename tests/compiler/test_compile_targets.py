"""Libraries for machines that are not here: they are made, linked, and of the right kind."""

import hashlib
import struct
import subprocess
from types import SimpleNamespace

import pytest

from mbody.cli.compile import DOOR, all_kernels, compile_libraries
from mbody.core import native_builder
from mbody.core.native_builder import builder_command, place
from mbody.core.selection import LEVELS
from mbody.image.arena import IMAGE_KERNELS
from mbody.image.fmu import SOURCES

KERNEL = "set_numbers"
FORMS = [f"mbody_{KERNEL}{form}" for form in ("", "_np", "_words")]
TABLES = ["mbody_entries", "mbody_object_head", "mbody_sources", "mbody_user_door"]
#: A library in C on the kernel, of which one function is seen.
PART = """
#include <stdint.h>
int32_t mbody_set_numbers_words(const int64_t *arguments, int64_t *results);
#ifdef _WIN32
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
int32_t seen(const int64_t *arguments, int64_t *results);
int32_t seen(const int64_t *arguments, int64_t *results) {
  return mbody_set_numbers_words(arguments, results);
}
"""


def build(folder, *options):
    """One kernel for Linux on x86-64, and the same module for the other machines."""
    pytest.importorskip("ziglang")
    others = [word for name in ("aarch64", "windows", "macos") for word in ("--also", name)]
    names = [place(all_kernels()[KERNEL])]
    line, settings = builder_command(names, "x86-64-v3", folder, "--whole", *others, *options)
    done = subprocess.run(line, env=settings, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(", untested") == 3


def words(content, at, form):
    return struct.unpack_from("<" + form, content, at)


def elf_machine(content):
    assert content[:6] == b"\x7fELF\x02\x01"
    return words(content, 18, "H")[0]


def elf_names(content):
    """Names of the defined dynamic symbols of an ELF file."""
    offset, size, count = words(content, 40, "Q")[0], *words(content, 58, "HH")
    sections = [words(content, offset + n * size, "IIQQQQIIQQ") for n in range(count)]
    found = []
    for section in sections:
        if section[1] != 11:  # SHT_DYNSYM
            continue
        texts = sections[section[6]][4]
        for at in range(section[4], section[4] + section[5], section[9]):
            name, _, _, home = words(content, at, "IBBH")
            if home:
                found.append(text(content, texts + name))
    return sorted(name for name in found if not name.startswith("_"))


def text(content, at):
    return content[at : content.index(b"\0", at)].decode()


def pe_parts(content):
    """Machine and names of the exports of a Windows library."""
    assert content[:2] == b"MZ"
    head = words(content, 0x3C, "I")[0]
    assert content[head : head + 4] == b"PE\0\0"
    machine, count = words(content, head + 4, "HH")
    optional, optional_size = head + 24, words(content, head + 20, "H")[0]
    assert words(content, optional, "H") == (0x20B,)  # 64 bits
    table = words(content, optional + 112, "I")[0]
    sections = [words(content, optional + optional_size + 40 * n + 8, "IIII") for n in range(count)]

    def offset(address):
        return next(raw + address - at for size, at, _, raw in sections if 0 <= address - at < size)

    number, _, names = words(content, offset(table) + 24, "III")
    places = words(content, offset(names), f"{number}I")
    return machine, sorted(text(content, offset(one)) for one in places)


def mach_o_parts(content):
    """Of a macOS library the kind of processor, the kinds of its load commands, and the names that
    others see.
    """
    magic, processor, _, _, count = words(content, 0, "IIIII")
    assert magic == 0xFEEDFACF
    kinds, seen, at = [], [], 32
    for _ in range(count):
        kind, size = words(content, at, "II")
        kinds.append(kind)
        if kind == 2:  # LC_SYMTAB
            symbols, number, texts = words(content, at + 8, "III")
            for n in range(number):
                name, bits, section = words(content, symbols + 16 * n, "IBB")
                if bits & 0x11 == 1 and section:  # external, not private to the library
                    seen.append(text(content, texts + name).removeprefix("_"))
        at += size
    return processor, kinds, sorted(name for name in seen if not name.startswith("_"))


@pytest.mark.numba
def test_a_library_for_every_machine(tmp_path):
    build(tmp_path)
    contents = {}
    for file in tmp_path.iterdir():
        content = file.read_bytes()
        assert hashlib.sha256(content[:-32]).digest() == content[-32:]
        contents[file.name] = content
    # the names are those that mbody looks for there
    wanted = {level.file for level in LEVELS} - {"linux-x86-64-v2.so", "linux-x86-64-v4.so"}
    assert contents.keys() == wanted
    assert elf_machine(contents["linux-x86-64-v3.so"]) == 62
    assert elf_machine(contents["linux-aarch64.so"]) == 183
    for name in ("linux-x86-64-v3.so", "linux-aarch64.so"):
        assert elf_names(contents[name]) == sorted([*FORMS, *TABLES])
    machine, exports = pe_parts(contents["windows-x86-64-v3.dll"])
    assert machine == 0x8664 and {*FORMS, *TABLES} <= set(exports)
    processor, kinds, seen = mach_o_parts(contents["macos-arm64.dylib"])
    assert processor == 0x0100000C and seen == sorted([*FORMS, *TABLES])
    assert 0x1D in kinds  # LC_CODE_SIGNATURE: nothing is loaded on arm64 without one


@pytest.mark.numba
def test_a_library_with_c_sources_shows_only_theirs(tmp_path):
    (tmp_path / "it").mkdir()
    part = tmp_path / "part.c"
    part.write_text(PART)
    build(tmp_path / "it", "--with", str(part))
    contents = {file.name: file.read_bytes() for file in (tmp_path / "it").iterdir()}
    assert elf_names(contents["linux-x86-64-v3.part.so"]) == ["seen"]
    assert elf_names(contents["linux-aarch64.part.so"]) == ["seen"]
    assert pe_parts(contents["windows-x86-64-v3.part.dll"])[1] == ["seen"]
    processor, _, seen = mach_o_parts(contents["macos-arm64.part.dylib"])
    assert processor == 0x0100000C and seen == ["seen"]


@pytest.mark.numba
def test_object_files_link_into_programs(tmp_path):
    """The kernel's own sources, and nothing of Python, are what an object needs."""
    from mbody.core.selection import ZIG

    build(tmp_path, "--object")
    main = tmp_path / "main.c"
    main.write_text(PART + "int main(void) { return seen(0, 0); }\n")
    for name, triple in (
        ("linux-x86-64-v3.o", "x86_64-linux-gnu.2.17"),
        ("linux-aarch64.o", "aarch64-linux-gnu.2.17"),
        ("windows-x86-64-v3.o", "x86_64-windows-gnu"),
        ("macos-arm64.o", "aarch64-macos.11.0"),
    ):
        program = tmp_path / "program.exe"
        line = [*ZIG, "-target", triple, str(main), str(tmp_path / name), "-o", str(program)]
        done = subprocess.run([*line, "-lm"], capture_output=True, text=True)
        assert done.returncode == 0 and program.exists(), done.stderr
        program.unlink()


@pytest.mark.parametrize(
    "form, options",
    [
        ({}, []),
        ({"images": True}, ["--object"]),
        ({"fmu": True}, [word for name in SOURCES for word in ("--with", name)]),
    ],
)
def test_what_the_command_builds(tmp_path, monkeypatch, form, options):
    lines = []

    def run(line, settings, progress):
        lines.append(line)
        return 0

    monkeypatch.setattr(native_builder, "run_builder", run)
    targets = ["x86-64-v3", "macos"]
    given = {"target": targets, "out": str(tmp_path), "images": False, "fmu": False}
    assert compile_libraries(SimpleNamespace(**(given | form))) == 0
    (line,) = lines
    kernels = {word.partition(":")[2] for word in line if word.startswith("mbody.kernels.")}
    own = {one.__name__ for one in IMAGE_KERNELS}
    assert kernels == own if form else kernels > own
    said = [word.rpartition("/")[2] for word in line]
    assert [*said[3:8], "--also"] == [
        "--target",
        "x86-64-v3",
        "--whole",
        "--also",
        "macos",
        "--also",
    ]
    assert said[8 : 8 + len(options)] == options
    door = {file.name for file in tmp_path.iterdir()}
    assert door == (set() if form.get("fmu") else set(DOOR))
