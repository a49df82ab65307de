"""What the tests share: meshes made in code, the benchmark where a checkout has it beside it, and a browser."""

import base64
import io
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import HealthCheck, settings
from PIL import Image

torch.set_num_threads(1)  # tiny inputs: threads cost more than they bring
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")  # a busy machine fails no test


def as_tensors(mesh: trimesh.Trimesh) -> tuple[torch.Tensor, torch.Tensor]:
    """Positions (V, 3) float64 and faces (3, F) of a trimesh."""
    pos = torch.tensor(mesh.vertices, dtype=torch.float64)
    return pos, torch.tensor(mesh.faces, dtype=torch.long).t().contiguous()


@pytest.fixture
def sphere_mesh():
    """Unit icosphere: 162 vertices, 320 faces, closed and smooth."""
    return as_tensors(trimesh.creation.icosphere(subdivisions=2))


@pytest.fixture
def cube_mesh():
    """Cube with 768 faces and sharp edges, side 2 about the origin."""
    cube = trimesh.creation.box(extents=(2, 2, 2))
    for _ in range(3):
        cube = cube.subdivide()
    return as_tensors(cube)


@pytest.fixture
def make_test_set(tmp_path):
    """Writes clean meshes, by name, as a test set ``set/test``, each with noise n1 and n2 that any method can take."""

    def make(shapes):
        folder = tmp_path / "set" / "test"
        generator = torch.Generator().manual_seed(0)
        for part in ("original", "noisy"):
            (folder / part).mkdir(parents=True)
        for name, clean in shapes.items():
            clean.export(folder / "original" / f"{name}.obj", digits=17)
            for level in (1, 2):
                noisy = clean.copy()
                noisy.vertices += 0.02 * level * torch.randn(clean.vertices.shape, generator=generator).numpy()
                noisy.export(folder / "noisy" / f"{name}_n{level}.obj", digits=17)
        return folder

    return make


@pytest.fixture
def test_set(make_test_set):
    """Folder with a ball and a box, each with noise n1 and n2."""
    return make_test_set(
        {"ball": trimesh.creation.icosphere(subdivisions=2), "box": trimesh.creation.box().subdivide()}
    )


@pytest.fixture(scope="session")
def cnr_root():
    """The CNR benchmark beside the checkout; tests that use it skip where it is absent."""
    root = Path(__file__).resolve().parents[2] / "shared" / "data" / "cnr"
    if not root.is_dir():
        pytest.skip("the CNR benchmark is not beside this checkout (../shared/data/cnr)")
    return root


@pytest.fixture(scope="session")
def cnr_folder(tmp_path_factory):
    """Tiny meshes in the layout of the CNR benchmark: two to train on, one to test on, in each subset."""
    root = tmp_path_factory.mktemp("cnr")
    generator = torch.Generator().manual_seed(0)
    shapes = {"ball": trimesh.creation.icosphere(subdivisions=2), "box": trimesh.creation.box().subdivide_loop(3)}
    for subset in ("Synthetic", "Kinect_v1", "Kinect_v2", "Kinect_Fusion"):
        for split, names in (("train", ("ball", "box")), ("test", ("ball",))):
            for part in ("original", "noisy"):
                (root / subset / split / part).mkdir(parents=True)
            for name in names:
                clean = shapes[name]
                clean.export(root / subset / split / "original" / f"{name}.obj")
                for ending in ("n1", "n2") if subset == "Synthetic" else ("noisy",):
                    noisy = clean.copy()
                    noisy.vertices += 0.02 * torch.randn(clean.vertices.shape, generator=generator).numpy()
                    noisy.export(root / subset / split / "noisy" / f"{name}_{ending}.obj")
    return root


PATIENCE = 300  # seconds, until an answer is given up: much more than a busy machine takes


class Browser:
    """A page of headless Chromium; commands of the DevTools protocol go through file descriptors 3 and 4."""

    def __init__(self, chromium, profile):
        self.to_browser, self.from_browser = os.pipe(), os.pipe()
        flags = ["--headless=new", "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={profile}"]
        flags += ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"]
        flags += ["--disable-extensions", "--no-first-run", "--disable-background-networking", "about:blank"]
        ends = f"3<&{self.to_browser[0]} 4>&{self.from_browser[1]}"
        self.process = subprocess.Popen(
            ["/bin/bash", "-c", f'exec "$0" "$@" {ends}', chromium, *flags],
            pass_fds=(self.to_browser[0], self.from_browser[1]),
            stderr=subprocess.DEVNULL,
        )
        self.number, self.rest, self.events, self.session = 0, b"", [], None
        target = self.send("Target.createTarget", url="about:blank")["targetId"]  # the browser's own may come later
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        self.resize()

    def send(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser[1], json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def receive(self, seconds=PATIENCE):
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.from_browser[0]], [], [], seconds)
            assert ready, "Chromium does not answer"
            self.rest += os.read(self.from_browser[0], 1 << 20)
        line, self.rest = self.rest.split(b"\0", 1)
        return json.loads(line)

    def evaluate(self, expression):
        return self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)["result"]

    def open(self, url):
        self.send("Page.navigate", url=url)
        self.wait(lambda: self.holds("document.readyState === 'complete' && location.href !== 'about:blank'"))
        self.settle()

    def holds(self, expression):
        return self.evaluate(expression).get("value") is True

    def wait(self, condition):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline
            time.sleep(0.05)

    def resize(self, width=1100, height=900):
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def settle(self):
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def picture(self):
        shot = self.send("Page.captureScreenshot", format="png")["data"]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB")).astype(int)

    def view(self):
        """The two halves of the 3D view, each without a rim."""
        box = "(({x, y, width, height}) => [x, y, width, height])"
        script = box + "(document.getElementById('canvas').getBoundingClientRect())"
        x, y, width, height = (round(value) for value in self.evaluate(script)["value"])
        shown = self.picture()[y : y + height, x : x + width]
        return shown[40:-8, 8 : width // 2 - 8], shown[40:-8, width // 2 + 8 : -8]

    def drag(self, x, y):
        mouse = {"button": "left", "buttons": 1, "clickCount": 1}
        self.send("Input.dispatchMouseEvent", type="mousePressed", x=250, y=400, **mouse)
        for step in (0.5, 1.0):
            self.send("Input.dispatchMouseEvent", type="mouseMoved", x=250 + step * x, y=400 + step * y, **mouse)
        self.send("Input.dispatchMouseEvent", type="mouseReleased", x=250 + x, y=400 + y, **mouse)
        self.settle()

    def click(self, selector):
        self.evaluate(f"document.querySelector('{selector}').click()")
        self.settle()

    def faults(self, own=("file:", "data:")):
        """Errors in the console, and what was fetched from outside the page."""
        told = [e["params"] for e in self.events if e.get("method") in ("Log.entryAdded", "Runtime.exceptionThrown")]
        asked = [e["params"]["request"]["url"] for e in self.events if e.get("method") == "Network.requestWillBeSent"]
        return told + [url for url in asked if not url.startswith(own)]

    def close(self):
        self.process.kill()
        self.process.wait()
        for end in (*self.to_browser, *self.from_browser):
            os.close(end)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Headless Chromium; tests that use it skip where there is none."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium here (Debian: apt-get install chromium)")
    opened = Browser(chromium, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()
