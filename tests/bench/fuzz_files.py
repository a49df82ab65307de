"""Damage mesh files by their structure, and read and write them back: no traceback, no long wait, nothing elsewhere.

    python tests/bench/fuzz_files.py --files 2000 --seeds 0 1 2

One process does the work, within limits of memory and time, and is started anew when it dies. Each file that is wrong
in the end is kept in the folder of ``--keep``.
"""

import argparse
import json
import multiprocessing
import random
import resource
import struct
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import torch
import trimesh
from PIL import Image

from dnf_pyg.errors import DNFError
from dnf_pyg.io import read_mesh, write_mesh

SECONDS, BYTES = 10, 2 << 30
NUMBERS = (0, 1, 2, 7, -1, 127, 128, 255, 256, 32767, 65535, 2**31 - 1, 2**31, 4_000_000_000, 2**32, 10**12, 10**19)
WORDS = (
    "nan",
    "inf",
    "-inf",
    "1e400",
    "1e-320",
    "0,5",
    "0x10",
    "1_0",
    "",
    "-",
    "#",
    "1/2/3",
    "1//1",
    "-3",
    "0",
    "9999999999999999999999",
)
NAMES = (
    "../victim.png",
    "/tmp/victim.png",
    "..\\victim.png",
    "victim\n.png",
    "%2e%2e/victim.png",
    "a" * 3000,
    "\0",
    "/dev/zero",
    "http://localhost/a.png",
    "a.png",
    "\ud800",
    ".bashrc",
)


def originals(folder: Path) -> dict[str, bytes]:
    """Small files of every format and kind."""
    box = trimesh.creation.box().subdivide()
    pos = torch.tensor(box.vertices)
    files = {}
    for name in ("a.obj", "a.ply", "a.stl", "a.off", "a.glb", "a.gltf"):
        write_mesh(box, pos, folder / name)
        files[name] = (folder / name).read_bytes()
    files["text.ply"] = box.export(file_type="ply", encoding="ascii")
    files["text.stl"] = box.export(file_type="stl_ascii").encode()
    shaded = box.copy()
    material = trimesh.visual.material.PBRMaterial(name="wood", baseColorTexture=Image.new("RGB", (2, 2), "red"))
    shaded.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2], material=material)
    scene = trimesh.Scene([shaded, box.apply_translation([3, 0, 0])])
    files["scene.glb"] = scene.export(file_type="glb", include_normals=True)
    files["rich.obj"] = b"mtllib a.mtl b.mtl\no part\n" + shaded.export(file_type="obj", include_normals=True).encode()
    rows = "".join(f"{x} {y} {z} 0 0 1\n" for x, y, z in box.vertices)
    files["normals.off"] = f"NOFF\n{len(box.vertices)} {len(box.faces)} 0\n{rows}".encode()
    files["normals.off"] += "".join(f"3 {a} {b} {c}\n" for a, b, c in box.faces).encode()
    lists = "property list uchar int vertex_indices\nproperty float nx\nproperty float ny\nproperty float nz\n"
    for order, sign in (("little", "<"), ("big", ">")):
        header = f"ply\nformat binary_{order}_endian 1.0\ncomment TextureFile a.png\nelement vertex 4\n"
        header += "".join(f"property double {axis}\n" for axis in "xyz") + f"element face 2\n{lists}"
        header += "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        body = struct.pack(sign + "12d", *range(10), 3.5, 1.25)
        body += struct.pack(sign + "B3i3f", 3, 0, 1, 2, 0, 0, 1) + struct.pack(sign + "B4i3f", 4, 0, 1, 2, 3, 0, 0, 1)
        files[f"{order}.ply"] = header.encode() + body + struct.pack(sign + "6i", 5, 0, 1, 2, -1, 3)
    return files


def damage_bytes(data: bytes, draw: random.Random) -> bytes:
    """Flip, cut, repeat, insert or overwrite, more often near the beginning, where the headers are."""
    content = bytearray(data)
    place = int(len(content) * draw.random() ** draw.choice((1, 3)))
    length = draw.randint(1, 30)
    match draw.randrange(6):
        case 0:
            content[place : place + 1] = bytes([draw.randrange(256)])
        case 1:
            del content[place:]
        case 2:
            content[place:place] = content[place : place + length] * draw.randint(1, 200)
        case 3:
            content[place:place] = draw.randbytes(length)
        case 4:
            content[place : place + 4] = struct.pack(draw.choice("<>") + "I", draw.choice(NUMBERS) % 2**32)
        case 5:
            content[place : place + 4] = struct.pack("<f", draw.choice((np.nan, np.inf, 1e38, -1e-40)))
    return bytes(content)


def damage_text(data: bytes, draw: random.Random) -> bytes:
    """Replace words, swap, drop or repeat lines, in the header or anywhere."""
    end = data.find(b"end_header")
    head, tail = (data[:end], data[end:]) if end > 0 and draw.random() < 0.8 else (data, b"")
    lines = head.split(b"\n")
    row = draw.randrange(len(lines))
    words = lines[row].split(b" ")
    word = draw.choice((str(draw.choice(NUMBERS)), draw.choice(WORDS), draw.choice(NAMES)))
    match draw.randrange(6):
        case 0 | 1:
            words[draw.randrange(len(words))] = word.encode(errors="surrogatepass")
            lines[row] = b" ".join(words)
        case 2:
            lines[row : row + 1] = [lines[row]] * draw.choice((0, 2, 300))
        case 3:
            lines.insert(row, lines[draw.randrange(len(lines))])
        case 4:
            lines[row] = draw.choice((b"mtllib ", b"comment TextureFile ", b"map_Kd ")) + word.encode(
                errors="surrogatepass"
            )
        case 5:
            types = (b"char", b"uchar", b"int", b"uint", b"float", b"double", b"list", b"short")
            lines[row] = b" ".join(draw.choice(types) if word in types else word for word in words)
    return b"\n".join(lines) + tail


def damage_tree(data: bytes, draw: random.Random) -> bytes:
    """Change a value of a glTF description, or its shape: cycles, depth, bombs, sparse accessors, lists of anything."""
    is_binary = data[:4] == b"glTF"
    size = struct.unpack_from("<I", data, 12)[0] if is_binary else len(data)
    tree = json.loads(data[20 : 20 + size] if is_binary else data)
    match draw.randrange(9):
        case 0:
            nodes = tree.setdefault("nodes", [{}])
            nodes[draw.randrange(len(nodes))]["children"] = [draw.randrange(-1, len(nodes) + 1) for _ in range(3)]
        case 1:
            depth = draw.choice((10, 300, 900, 20_000))
            tree["nodes"] = [{"children": [number + 1]} for number in range(depth)] + [{"mesh": 0}]
        case 2:
            tree["accessors"][draw.randrange(len(tree["accessors"]))]["sparse"] = {"count": draw.choice(NUMBERS)}
        case 3:
            tree["buffers"][0]["uri"] = draw.choice(
                ("data:,", "data:;base64," + "A" * 10**6, "data:;base64,!!", *NAMES)
            )
        case 4:
            tree["images"] = [{"uri": draw.choice(NAMES)} for _ in range(draw.choice((1, 20)))]
        case 5:
            mesh = draw.choice(tree["meshes"])
            mesh["primitives"] = (mesh["primitives"] * draw.choice((2, 1000, 20_000)))[:20_000]
        case 6:
            tree["extras"] = json.loads("[" * 800 + "]" * 800)
        case _:
            for _ in range(draw.randint(1, 3)):
                owner, key = draw.choice(list(entries(tree)))
                values = (*NUMBERS, "x", None, True, [], {}, [1, "a", None], 1.5, float("nan"), *NAMES)
                owner[key] = draw.choice(values)
    text = json.dumps(tree).encode()
    if draw.random() < 0.02:
        text = text[:-1] + b',"extras":' + b"[" * 100_000 + b"]" * 100_000 + b"}"
    if not is_binary:
        return text
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    return (
        struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + rest
    )


def entries(value: object) -> list[tuple]:
    """Every place in a tree of lists and dictionaries, as the one that holds it and its key."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place for key, inside in items for place in [(value, key), *entries(inside)]]


def damaged(name: str, data: bytes, draw: random.Random) -> bytes:
    """One to three changes."""
    for _ in range(draw.randint(1, 2)):
        is_tree = name.endswith((".glb", ".gltf"))
        try:
            data = (
                draw.choice((damage_tree, damage_tree, damage_bytes))
                if is_tree
                else draw.choice((damage_text, damage_bytes))
            )(data, draw)
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, struct.error, RecursionError):
            data = damage_bytes(data, draw)  # an earlier change has left no structure to change
    return data


def attempt(path: Path, out: Path, target: str) -> str:
    """Read a file, write it with other positions and read that; say what came of it."""
    try:
        mesh = read_mesh(path)
    except DNFError as error:
        return "refused" if str(error).startswith("Expected ") and "\n" not in str(error)[:20] else f"message: {error}"
    used = torch.zeros(len(mesh.pos), dtype=torch.bool)
    used[mesh.face] = True
    if not (mesh.pos[used].abs() <= 1e30).all():
        return "not finite"  # `denoise` refuses it
    try:
        write_mesh(mesh, mesh.pos + used[:, None] * 0.25, out / target)
    except DNFError as error:
        return f"refused when written: {error}"
    if path.suffix == Path(target).suffix and not torch.equal(read_mesh(out / target).face, mesh.face):
        return "other faces"
    return "rewritten"


def work(pipe: multiprocessing.connection.Connection, folder: Path) -> None:
    """Do what comes through the pipe."""
    resource.setrlimit(resource.RLIMIT_AS, (BYTES + (3 << 30), BYTES + (3 << 30)))  # libraries map more than they use
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    pipe.send(None)
    while (job := pipe.recv()) is not None:
        path, target = job
        try:
            told = attempt(path, folder / "out", target)
        except Exception as error:
            told = f"traceback: {type(error).__name__}: {str(error)[:200]}"
        pipe.send((told, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024))


def start(folder: Path) -> tuple:
    """A process that waits for work, and our end of its pipe."""
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=work, args=(theirs, folder), daemon=True)
    process.start()
    theirs.close()
    ours.recv()  # it is there
    return process, ours


def snapshot(folder: Path) -> dict[str, bytes]:
    """Content of all files below a folder but those of the output."""
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file() and "out" not in path.parts}


def run(seed: int, files: int, keep: Path | None) -> tuple[Counter, list[str], float, int]:
    """Try files of one seed: how many came to which end, what is wrong, the slowest and the largest."""
    draw = random.Random(seed)
    count: Counter = Counter()
    wrong: list[str] = []
    slowest, largest = 0.0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "in").mkdir()
        (folder / "victim.png").write_bytes(b"precious")
        (folder / "in" / "a.mtl").write_bytes(b"newmtl a\nmap_Kd a.png\nmap_Ks ../victim.png\n")
        (folder / "in" / "a.png").write_bytes(b"picture")
        sources = originals(folder)
        before = snapshot(folder)
        process, pipe = start(folder)
        for number in range(files):
            source = draw.choice(list(sources))
            path = folder / "in" / f"fuzzed{Path(source).suffix}"
            data = damaged(source, sources[source], draw)
            path.write_bytes(data)
            target = f"result{draw.choice((path.suffix, path.suffix, '.obj', '.ply', '.glb', '.gltf', '.off', '.stl'))}"
            (folder / "out").mkdir(exist_ok=True)
            begun = time.monotonic()
            pipe.send((path, target))
            try:
                told, used = pipe.recv() if pipe.poll(3 * SECONDS) else ("too long", 0)
            except EOFError:
                told, used = "killed", 0
            seconds = time.monotonic() - begun
            slowest, largest = max(slowest, seconds), max(largest, used)
            if told in ("too long", "killed") or used > BYTES:
                process.kill()
                process.join()
                process, pipe = start(folder)
            path.unlink()
            left = sorted(
                str(file.relative_to(folder / "out")) for file in (folder / "out").rglob("*") if file.is_file()
            )
            fault = "" if told in ("refused", "not finite", "rewritten") else told
            fault = (
                fault
                or (f"{seconds:.0f} s" if seconds > SECONDS else "")
                or (f"{used >> 20} MiB" if used > BYTES else "")
            )
            fault = fault or ("wrote elsewhere" if snapshot(folder) != before else "")
            fault = fault or (f"left {left}" if told != "rewritten" and left else "")
            fault = fault or (
                f"odd names {left}" if any(not name.startswith(("result", "a.")) for name in left) else ""
            )
            if fault:
                wrong.append(f"seed {seed}, file {number}, {source} to {target}: {fault}")
                if keep:
                    keep.mkdir(exist_ok=True)
                    (keep / f"{seed}_{number}_{target}{path.suffix}").write_bytes(data)
            count[source, "wrong" if fault else told] += 1
            for file in left:
                (folder / "out" / file).unlink()
        pipe.send(None)
        process.join()
    return count, wrong, slowest, largest


def main() -> int:
    """Try all seeds and print what came of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=1000, help="files per seed (%(default)s)")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="(%(default)s)")
    parser.add_argument("--keep", type=Path, help="folder for the files that went wrong")
    options = parser.parse_args()
    faults = 0
    for seed in options.seeds:
        count, wrong, slowest, largest = run(seed, options.files, options.keep)
        faults += len(wrong)
        totals: Counter = Counter()
        for (_, told), number in count.items():
            totals[told] += number
        print(f"seed {seed}: {dict(totals)}; slowest {slowest:.1f} s, memory {largest >> 20} MiB", flush=True)
        for source in sorted({source for source, _ in count}):
            print(f"  {source:12}", {told: number for (name, told), number in sorted(count.items()) if name == source})
        for line in wrong:
            print("  WRONG", line, flush=True)
    return min(faults, 1)


if __name__ == "__main__":
    sys.exit(main())
