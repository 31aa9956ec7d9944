"""The files that a scene reads, the text of PROVENANCE.toml, and when a reference is stale."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

import mitsuba_reference as ref


@pytest.fixture
def nested(tmp_path: Path) -> Path:
    """A scene that reads a mesh named by a parameter, and includes a file that includes another, which names a texture."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "nested.xml").write_text(
        '<scene version="3.0.0"><default name="m" value="a"/><default name="m" value="b"/><default name="mesh" value="stone"/>'
        '<shape type="ply"><string name="filename" value="$mesh-$m.ply"/></shape>'
        '<include filename="parts/one.xml"/></scene>'
    )
    (tmp_path / "parts" / "one.xml").write_text('<scene version="3.0.0"><include filename="two.xml"/></scene>')
    (tmp_path / "parts" / "two.xml").write_text(
        '<texture type="bitmap" version="3.0.0"><string name="filename" value="wood.png"/></texture>'
    )
    for name in ("stone-a.ply", "stone-b.ply", "wood.png"):
        (tmp_path / name).write_text(name)
    return tmp_path / "nested.xml"


def test_every_file_is_found(nested: Path) -> None:
    assert ref.scene_files(nested) == ["nested.xml", "parts/one.xml", "parts/two.xml", "stone-a.ply", "wood.png"]
    assert "stone-b.ply" in ref.scene_files(nested, {"m": "b"})


@pytest.mark.parametrize(
    ("text", "expected"),
    [("$a", "1"), ("$ab-$a", "2-1"), (r"\$a $a", "$a 1"), ("$unknown", "$unknown"), ("plain", "plain"), ("$b", "$a")],
)
def test_substitution(text: str, expected: str) -> None:
    assert ref.substitute(text, {"a": "1", "ab": "2", "b": "$a"}) == expected


def test_a_missing_mesh_is_one_clear_line(nested: Path) -> None:
    (nested.parent / "stone-a.ply").unlink()
    with pytest.raises(ref.UserError, match=r"nested\.xml: cannot read stone-a\.ply: No such file"):
        ref.file_hashes(nested)


def test_endless_includes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "loop.xml"
    path.write_text('<scene version="3.0.0"><include filename="loop.xml"/></scene>')
    with pytest.raises(ref.UserError, match="deeper than 15"):
        ref.scene_files(path)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<integrator type="path"/>', "path"),
        ('<default name="i" value="direct"/><integrator type="$i"/>', "direct"),
        ('<integrator type="moment"><integrator type="path" name="a"/></integrator>', "moment(path)"),
    ],
)
def test_integrator_name(tmp_path: Path, body: str, expected: str) -> None:
    path = tmp_path / "s.xml"
    path.write_text(f'<scene version="3.0.0">{body}</scene>')
    assert ref.integrator_name(path) == expected


def test_toml_round_trip() -> None:
    table = {
        "text": 'quote " back\\slash\ttab \x7f é',
        "count": 64,
        "rate": 1.25e-7,
        "flag": True,
        "list": [0.1, 2.0, 3e-9],
        "files": {"../meshes/a b.ply": "00ff", "plain_name": "x"},
        "empty": {},
    }
    assert tomllib.loads(ref.toml_text(table).replace("flag = True", "flag = true")) == table


def fresh_reference(scene: Path) -> Path:
    """A reference folder that belongs to the scene, with empty files instead of images."""
    folder = scene.parent / "reference"
    folder.mkdir()
    (folder / "PROVENANCE.toml").write_text(ref.toml_text({"parameters": {}, "files": ref.file_hashes(scene)}))
    for name in ("reference.exr", "tiles.npy"):
        (folder / name).touch()
    return folder


def edit(name: str, text: str) -> Callable[[Path], None]:
    return lambda root: (root / name).write_text(text) and None


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (edit("nested.xml", '<scene version="3.0.0"/>'), "nested.xml has changed"),
        (edit("parts/two.xml", '<scene version="3.0.0"/>'), "wood.png is recorded but not read"),
        (edit("stone-a.ply", "other"), "stone-a.ply has changed"),
        (
            edit("parts/one.xml", '<scene version="3.0.0"><include filename="two.xml"/><include filename="three.xml"/></scene>'),
            "parts/three.xml is read but not recorded",
        ),
        (lambda root: (root / "reference" / "tiles.npy").unlink(), "missing tiles.npy"),
        (lambda root: (root / "reference" / "reference.exr").unlink(), "missing reference.exr"),
        (lambda root: (root / "reference" / "PROVENANCE.toml").unlink(), "missing PROVENANCE.toml"),
        (edit("reference/PROVENANCE.toml", "files = "), "cannot be read"),
        (edit("reference/PROVENANCE.toml", "[files]\n"), "cannot be read"),
    ],
)
def test_each_change_makes_a_reference_stale(nested: Path, change: Callable[[Path], None], reason: str) -> None:
    folder = fresh_reference(nested)
    (nested.parent / "parts" / "three.xml").write_text('<scene version="3.0.0"/>')
    assert ref.stale_reasons(nested, folder) == []
    change(nested.parent)
    assert any(reason in found for found in ref.stale_reasons(nested, folder))


def test_an_unused_file_does_not_make_a_reference_stale(nested: Path) -> None:
    folder = fresh_reference(nested)
    (nested.parent / "stone-b.ply").write_text("other")
    assert ref.stale_reasons(nested, folder) == []


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM.so.19.1", (19, 1)),
        ("libLLVM-19.so", (19,)),
        ("libLLVM-14.0.6.so.1", (14, 0, 6)),
        ("libLLVM-15.so.1", (15,)),
        ("libLLVM.so.22.1-rust-1.95.0-stable", (22, 1)),
        ("libLLVM-22-rust-1.95.0-stable.so", ()),
        ("libLLVMSupport.so", ()),
        ("libLLVM.so", ()),
    ],
)
def test_llvm_versions_are_read_from_names(name: str, version: tuple[int, ...]) -> None:
    assert ref.llvm_version(Path(name)) == version


def test_the_newest_usable_llvm_is_chosen(tmp_path: Path) -> None:
    for name in ("libLLVM-16.so.1", "libLLVM-9.so.1"):
        (tmp_path / name).touch()
    assert ref.newest_llvm([str(tmp_path)]) is None
    for name in ("libLLVM.so.19.1", "libLLVM.so.22.1", "libLLVM.so.20.1"):
        (tmp_path / name).touch()
    assert ref.newest_llvm([str(tmp_path)]) == tmp_path / "libLLVM.so.22.1"


def test_the_llvm_of_a_rust_toolchain_is_used_if_the_system_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system, rust = tmp_path / "libLLVM.so.19.1", tmp_path / "toolchains" / "stable" / "lib" / "libLLVM.so.22.1-rust-1.95.0-stable"
    rust.parent.mkdir(parents=True)
    monkeypatch.setattr(ref, "LLVM_FOLDERS", (str(tmp_path),))
    monkeypatch.setenv("RUSTUP_HOME", str(tmp_path))
    assert ref.find_llvm() is None
    rust.touch()
    assert ref.find_llvm() == rust
    system.touch()
    assert ref.find_llvm() == system
