"""Component files: the body is that of the same words in Python; mistakes have file and line."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.command import ROOT
from cases.files.schema import answer
from cases.files.toml_files import SOLID
from cases.refusals import refuses
from cases.solid import KINDS, block, reduced
from rom.cli.main import main
from rom.config.component import read_component

PART = """\
name = "bar"

[matrices]
stiffness = "bar.op4:KAA"
mass = "bar.op4:MAA"
nodes = "bar.csv"

[matrices.sets]
root = [{root}]
tip = [{tip}]

[interfaces]
root = "rbe2"
tip = {{ kind = "rbe2" }}

[reduction]
modes = 6
reference = ["root", "tip"]

[damping]
ratio = "1 %"
fixed = ["root:xyz rx", "tip:yz"]

[output]
file = "bar.rom.npz"
"""


@pytest.fixture(scope="module")
def bar():
    return block(cells=(6, 1, 1))


@pytest.fixture
def folder(bar, tmp_path, monkeypatch):
    rom.io.write_op4({"KAA": bar.K, "MAA": bar.M}, tmp_path / "bar.op4")
    rows = [f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(bar.points.tolist())]
    (tmp_path / "bar.csv").write_text("\n".join(rows) + "\n")
    sides = bar.interfaces.items()
    labels = {name: ", ".join(map(str, side.nodes + 1)) for name, side in sides}
    (tmp_path / "bar.toml").write_text(PART.format(**labels))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_body_is_that_of_python(folder, bar):
    body = read_component("bar.toml").body()
    damping = rom.ModalDamping(0.01, fixed={"root": "xyz rx", "tip": "yz"})
    same = reduced(6, bar, reference=("root", "tip"), name="bar", damping=damping)
    assert body.name == "bar" and body.reference == same.reference
    assert_allclose(body.omega, same.omega, rtol=1e-7)
    assert_allclose(np.diag(body.D), 0.02 * body.omega, rtol=1e-9)
    assert_allclose(body.frequencies(4, fixed=("root",)), same.frequencies(4, fixed=("root",)),
                    rtol=1e-7)  # fmt: skip


def test_options_go_before_the_file_and_choose_the_certificate(folder, capsys):
    short = "reduce bar.toml -m 3 --name short -q".split()
    found = answer(capsys, *short, codes=(0, 5))
    assert found["name"] == "short" and found["output"] == "bar.rom.npz"
    assert rom.load("bar.rom.npz").n_modes == found["n_modes"] == 3 + 6
    damped = [*"reduce bar.toml -o held.npz -q --reference tip --no-certificate".split()]
    damped += ["--damping-ratio", "0.02", "--damping-fixed", "tip"]
    assert main(damped) == 0
    held = rom.load("held.npz")
    assert_allclose(np.diag(held.D), 0.04 * held.omega, rtol=1e-9)
    assert main(damped[:-2]) == 0  # as in the file, between the pins
    pinned = rom.load("held.npz").with_reference(("root", "tip"))
    assert_allclose(np.diag(pinned.D), 0.04 * pinned.omega, rtol=1e-9)
    other = "reduce bar.toml --f-max 3e3 --reference tip --no-certificate -o other.npz -q"
    found = answer(capsys, *other.split())
    assert found["output"] == "other.npz" and found["certificate"] is None
    assert "tip" in found["reference"] and "f_max=3000" in str(found["provenance"])
    given = ("reduction", "certificate")
    assert read_component("bar.toml", {given: "full"}).values["reduction"]["certificate"] == "full"
    with pytest.raises(rom.ConfigError, match='must be true, false or "full"'):
        read_component("bar.toml", {given: "half"})
    assert main(["reduce", "bar.toml", "-m", "3", "--full-certificate", "-q"]) in (0, 5)
    assert main(["reduce", "bar.toml", "--full-certificate", "--no-certificate"]) == 2
    assert "not allowed with" in capsys.readouterr().err


def test_modes_of_a_component_have_the_interfaces_of_its_body(folder, bar, capsys):
    found = answer(capsys, "modes", "bar.toml", "--fixed", "root", "-n", 2)
    expected = rom.modes(bar, 2, fixed=("root",), interfaces=KINDS).frequencies
    assert_allclose(found["frequencies"], expected, rtol=1e-8)
    assert found["fixed"] == ["root"]
    assert main(["modes", "bar.toml", "--scale", "1e-3"]) == 2
    assert "--scale does not go with a .toml file" in capsys.readouterr().err


def test_numbers_come_in_si_or_for_the_geometry_and_materials_by_region(tmp_path):
    (tmp_path / "part.toml").write_text(SOLID)
    part = read_component(tmp_path / "part.toml")
    file, how = part.mesh
    assert file == tmp_path / "part.geo"
    assert how["scale"] == 1e-3 and how["parameters"]["n"] == 3
    assert_allclose(how["parameters"]["lc"], 4.0, rtol=1e-15)
    assert_allclose(how["parameters"]["angle"], np.pi / 2, rtol=1e-15)
    assert part.material() == rom.Material(E=210e9, nu=0.3, rho=7850.0)
    wood = 'E = ["12 GPa", 1e9, 1e9]\nnu = [0.3, 0.3, 0.3]\nG = [7e8, 7e8, 7e8]\nrho = 450\n'
    steel = SOLID.partition("[material]\n")[2]
    (tmp_path / "part.toml").write_text(f"[material.core]\n{wood}\n[material.skin]\n{steel}")
    solids = read_component(tmp_path / "part.toml").material()
    assert solids["skin"] == rom.Material(E=210e9, nu=0.3, rho=7850.0)
    assert solids["core"].E == (12e9, 1e9, 1e9) and solids["core"].rho == 450


HELD = '[interfaces]\na = "rbe2"\n'
KIND = HELD.replace('"rbe2"', '{ kind = "polynomal", order = 3 }')
MISTAKES = {  # what stands in the file, what instead, and what is said
    "wrong dimension": ('"210 GPa"', '"210 mm"', "part.toml:9: material.E: '210 mm' is a length"),
    "misspelt key": ("nu =", "nuu =", "2 mistakes. line 8: nu is missing", "line 10: ", "'nuu'"),
    "misspelt table": ("[geometry.", "[geometri.", "part.toml:4: ", "'geometri'. Did you mean"),
    "twice": ("nu = 0.3", 'E = "70 GPa"', "part.toml:10: 'material.E'", "in lines 9 and 10"),
    "no text": ('"mm"', "mm", "part.toml:3: this is no TOML: invalid value."),
    "number for a table": (SOLID, "material = 3\n", "part.toml:1: material = 3: needed is a table"),
    "kind": (SOLID, KIND, "part.toml:2: interfaces.a.kind = 'polynomal'", "Did you mean poly"),
    "kind missing": (SOLID, KIND.replace("kind", "king"), "missing in [interfaces.a]"),
    "negative count": (SOLID, "[reduction]\nmodes = -1\n", "must be a whole number from 0"),
    "a mechanism": (SOLID, "[bodies.a]\n", "part.toml:1: this is a mechanism; a component is need"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_told_with_file_and_line(case, tmp_path):
    old, new, *expected = MISTAKES[case]
    (tmp_path / "part.toml").write_text(SOLID.replace(old, new))
    with pytest.raises(rom.ConfigError) as refused:
        read_component(tmp_path / "part.toml")
    assert not [words for words in expected if words not in str(refused.value)]


def test_missing_and_unreadable_files(tmp_path):
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe4"\n')
    for name in ("no.toml", "latin.toml", "."):
        refuses(rom.FileFormatError, "", read_component, tmp_path / name)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "neither geometry nor matrices"),
        (SOLID + '[matrices]\nstiffness="a"\nmass="b"\nnodes="c.csv"\n', "both geometry and"),
        (SOLID, "the component has no interface"),
        (SOLID + HELD.replace("rbe2", "rbe4"), "part.toml:13: interface 'a' has the kind 'rbe4'"),
        (SOLID + HELD + '[reduction]\nf_max = 10\nmethod = "rubin"\n',
         "part.toml:14: f_max belongs to craig-bampton, not to rubin"),
        (SOLID + HELD + "[reduction]\nf_max = 10\nmodes = 3\n",
         "craig-bampton has f_max; leave modes out"),
        (SOLID + HELD + "[damping]\nalpha = 1\nratio = 1\n", "part.toml:14: [damping] needs eit"),
        (SOLID + HELD + '[damping]\nalpha = 1\nfixed = ["a"]\n', "part.toml:14: [damping] needs"),
        (SOLID.replace("nu = 0.3", "nu = 0.7") + HELD, "part.toml:8: nu = 0.7 is outside"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_told_before_anything_is_meshed(text, words, tmp_path):
    (tmp_path / "part.toml").write_text(text)
    part = read_component(tmp_path / "part.toml")
    with pytest.raises(rom.RomError) as refused:
        part.body() if "interface" in text or text == SOLID else part.model()
    assert words in str(refused.value)


@pytest.mark.long
@pytest.mark.fenicsx
def test_the_sample_is_meshed_as_the_shell_changes_it(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    words = ("mesh", "meshes/connecting_rod.toml", "-q", "-p")
    found = [answer(capsys, *words, f"lc={size}") for size in ("0.012", "0.009")]
    assert set(found[0]["interfaces"]) == {"pin_a", "pin_b"}
    assert found[0]["cells"] < found[1]["cells"]


def keys_of(kind, seen):
    """Names of all keys a kind knows, however deep."""
    from rom.config.page import tables

    for _, table in tables(kind):
        for key in table.keys:
            seen.add((key.name, key.about))
            keys_of(key.kind, seen)
    return seen


def test_the_page_has_every_key_with_its_meaning():
    from rom.config.component_keys import TABLE
    from rom.config.mechanism_keys import mechanism_table
    from rom.config.page import page

    samples = [(ROOT / "meshes" / "connecting_rod.toml").read_text()]
    samples += [(ROOT / "demos" / "slider_crank.toml").read_text()]
    text = page(*samples)
    known = keys_of(mechanism_table(), keys_of(TABLE, set()))
    assert len(known) > 120
    for name, about in known:
        meant = about.replace("[", "\\[").replace("]", "\\]")
        row = [line for line in text.splitlines() if line.startswith(f"| `{name}` |")]
        assert any(meant in line for line in row), name
    assert "| must be given | Young's modulus. |" in text and '"mean-axis"' in text
    assert all(sample.strip() in text for sample in samples)


DEFLECTION = """
[reduction.nonlinear]
modes = 2
loads.tip = { force = ["0 N", "2 kN", "0 N"], moment = [0, 0, "3 N m"] }
"""
TURNING = 'spin = [0, 0, "30 rpm"]\nabout = [0, "20 mm", 0]\nsnapshots = true\nsampling = 0.01\n'
TURNED = {"spin": (0.0, 0.0, np.pi), "about": (0.0, 0.02, 0.0), "snapshots": True, "sampling": 0.01}


@pytest.mark.parametrize(
    ("more", "given"),
    [
        ("shapes = 9\n", {"n_shapes": 9}),
        ('tol = 0.002\nfixed = "hub:yz"\n', {"tol": 0.002, "fixed": ("hub:yz",)}),
        ("steps = 7\n", {"n_steps": 7}),
        (TURNING, TURNED),
    ],
)
def test_loads_of_large_deflection_are_those_of_the_same_words_in_python(folder, more, given):
    file = folder / "bar.toml"
    assert read_component(file).nonlinear() is None
    plain = file.read_text()
    file.write_text(plain + DEFLECTION + more)
    loads = {"tip": (0.0, 2000.0, 0.0, 0.0, 0.0, 3.0)}
    assert read_component(file).nonlinear() == rom.Geometric(loads=loads, n_modes=2, **given)
    if "n_shapes" in given:
        refuses(rom.ConfigError, "no finite elements", read_component(file).body)
    file.write_text(plain + DEFLECTION.replace("2 kN", "0 N").replace("3 N m", "0 N m"))
    refuses(rom.ConfigError, "bar.toml:.*it needs a force", read_component(file).nonlinear)
