"""The report page in a real browser: headless Chromium, driven through its debugging pipe, without network."""

import base64
import io
import json
import os
import select
import shutil
import subprocess
import time

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from dnf_pyg.view import write_index, write_report, write_view

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SIZE = {"width": 1100, "height": 900}
PATIENCE = 300  # seconds, until an answer is given up: much more than a busy machine takes

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here (Debian: apt-get install chromium)")


class Browser:
    """A page of headless Chromium; commands of the DevTools protocol go through file descriptors 3 and 4."""

    def __init__(self, profile):
        self.to_browser, self.from_browser = os.pipe(), os.pipe()
        flags = ["--headless=new", "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={profile}"]
        flags += ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"]
        flags += ["--disable-extensions", "--no-first-run", "--disable-background-networking", "about:blank"]
        ends = f"3<&{self.to_browser[0]} 4>&{self.from_browser[1]}"
        self.process = subprocess.Popen(
            ["/bin/bash", "-c", f'exec "$0" "$@" {ends}', CHROMIUM, *flags],
            pass_fds=(self.to_browser[0], self.from_browser[1]),
            stderr=subprocess.DEVNULL,
        )
        self.number, self.rest, self.events, self.session = 0, b"", [], None
        target = self.send("Target.createTarget", url="about:blank")["targetId"]  # the browser's own may come later
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        self.send("Emulation.setDeviceMetricsOverride", **SIZE, deviceScaleFactor=1, mobile=False)

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

    def open(self, path, fragment=""):
        self.send("Page.navigate", url=path.as_uri() + fragment)
        deadline = time.monotonic() + PATIENCE
        while (
            self.evaluate("document.readyState === 'complete' && location.protocol === 'file:'").get("value")
            is not True
        ):
            assert time.monotonic() < deadline
        self.settle()

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

    def faults(self):
        """Errors in the console, and what was fetched from outside the page."""
        told = [e["params"] for e in self.events if e.get("method") in ("Log.entryAdded", "Runtime.exceptionThrown")]
        asked = [e["params"]["request"]["url"] for e in self.events if e.get("method") == "Network.requestWillBeSent"]
        return told + [url for url in asked if not url.startswith(("file:", "data:"))]

    def close(self):
        self.process.kill()
        self.process.wait()
        for end in (*self.to_browser, *self.from_browser):
            os.close(end)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture
def page(tmp_path, sphere_mesh):
    pos, face = sphere_mesh
    noise = torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    path = tmp_path / "page.html"
    write_report(
        path,
        pos + 0.05 * noise,
        pos + 0.01 * noise,
        face,
        title="a <b> & c.obj",
        reference=pos,
        figures={"Mean error": ("12.3°", "2.1°"), "Faces": ("320",)},
        settings={"strength": 1.0},
    )
    return path


def share_drawn(half):
    """Pixels that differ from the background, taken from the upper left corner."""
    return (abs(half - half[0, 0]).sum(axis=-1) > 30).mean()


def difference(first, second):
    return np.abs(first - second).mean()


def test_shows_both_meshes_without_network_or_errors(browser, page):
    browser.open(page)
    before, after = browser.view()
    assert share_drawn(before) > 0.25
    assert share_drawn(after) > 0.25
    assert difference(before[:, : after.shape[1]], after[:, : before.shape[1]]) > 1  # noisy and smooth
    assert browser.evaluate("document.title")["value"] == "a <b> & c.obj"
    assert browser.faults() == []


def test_drag_turns_both_meshes_and_reset_turns_them_back(browser, page):
    browser.open(page)
    start = browser.view()
    browser.drag(120, 60)
    turned = browser.view()
    assert difference(start[0], turned[0]) > 1
    assert difference(start[1], turned[1]) > 1
    browser.click("#reset")
    back = browser.view()
    assert difference(start[0], back[0]) < 0.1
    assert difference(start[1], back[1]) < 0.1
    assert browser.faults() == []


def test_colour_switch(browser, page):
    browser.open(page)
    shaded = browser.view()[1]
    drawn = abs(shaded - shaded[0, 0]).sum(axis=-1) > 30
    colourful = {}
    for mode in ("moved", "error"):
        browser.click(f"[data-mode={mode}]")
        assert browser.evaluate("document.querySelectorAll('[data-mode][aria-pressed=true]').length")["value"] == 1
        colourful[mode] = browser.view()
        spread = np.ptp(colourful[mode][0][drawn[:, : colourful[mode][0].shape[1]]], axis=-1).mean()
        assert spread > 20, mode
    assert difference(colourful["moved"][0], colourful["error"][0]) > 5
    assert colourful["error"][0][..., 1].mean() < colourful["error"][1][..., 1].mean()  # redder before than after
    pressed = "document.querySelector('[data-mode][aria-pressed=true]').dataset.mode"
    browser.send("Page.navigate", url="about:blank")
    browser.open(page, "#moved")
    assert browser.evaluate(pressed)["value"] == "moved"
    assert difference(browser.view()[1], colourful["moved"][1]) < 0.1
    browser.click("[data-mode=shaded]")
    assert difference(shaded, browser.view()[1]) < 0.1
    assert browser.faults() == []


def halves(browser):
    """The two halves of the whole view, of the same size."""
    left, right = browser.view()
    width = min(left.shape[1], right.shape[1])
    return left[:, :width], right[:, -width:]


def test_swipe_shows_each_mesh_on_its_side_of_the_divider(browser, page):
    browser.open(page, "#swipe")
    assert browser.evaluate("document.getElementById('handle').hidden")["value"] is False
    middle = halves(browser)
    box = browser.evaluate(
        "(({x, y, width}) => [x, y, width])(document.getElementById('view').getBoundingClientRect())"
    )
    x, y, width = box["value"]
    mouse = {"button": "left", "buttons": 1, "clickCount": 1, "y": y + 60}
    browser.send("Input.dispatchMouseEvent", type="mousePressed", x=x + width / 2, **mouse)
    browser.send("Input.dispatchMouseEvent", type="mouseMoved", x=x + 0.9 * width, **mouse)
    browser.send("Input.dispatchMouseEvent", type="mouseReleased", x=x + 0.9 * width, **mouse)
    browser.settle()
    moved = halves(browser)
    assert difference(middle[0], moved[0]) < 0.1  # the noisy mesh, now on the right side, too
    assert difference(middle[1], moved[1]) > 1
    assert browser.faults() == []


def test_blink_shows_one_mesh_at_a_time(browser, page):
    browser.open(page, "#blink")
    assert browser.evaluate("document.querySelectorAll('.label:not([hidden])').length")["value"] == 1
    shown = "document.querySelector('.label:not([hidden])').textContent"
    first = browser.evaluate(shown)["value"]
    changed = f"new Promise(done => setInterval(() => {{ if ({shown} !== '{first}') done(true) }}, 20))"
    assert browser.evaluate(changed)["value"] is True
    assert browser.faults() == []


def test_share_of_the_movement_is_shown_and_saved(browser, tmp_path, sphere_mesh):
    pos, face = sphere_mesh
    after = pos * torch.tensor([1.0, 0.8, 1.2]) + torch.tensor([300.0, 0, 0])
    before = pos + torch.tensor([300.0, 0, 0])
    write_report(tmp_path / "page.html", before, after, face, title="ball.ply, denoised")
    browser.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    browser.open(tmp_path / "page.html")
    whole = browser.view()
    slide = (
        "(input => { input.value = %s; input.dispatchEvent(new Event('input')); })(document.getElementById('strength'))"
    )
    browser.evaluate(slide % 0)
    browser.settle()
    none = browser.view()
    width = min(half.shape[1] for half in none)
    assert difference(none[0][:, :width], none[1][:, :width]) < 0.5  # as before
    assert difference(whole[0], none[0]) < 0.1
    browser.evaluate(slide % 0.25)
    browser.click("#save")
    saved, deadline = tmp_path / "ball.ply_denoised_0.25.ply", time.monotonic() + PATIENCE
    while not saved.is_file():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    mesh = trimesh.load(saved, process=False)
    np.testing.assert_allclose(mesh.vertices, before.lerp(after, 0.25).numpy(), atol=1e-6)
    assert (mesh.faces == face.t().numpy()).all()
    assert browser.faults() == []


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_axis_buttons_look_along_an_axis_and_then_back(browser, tmp_path, axis):
    """Half of a ball, whose outside is seen from one end of the axis and whose inside, blue, from the other."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, axis] > 0)], append=True)
    write_view(
        tmp_path / "page.html", {"half": (torch.tensor(half.vertices), torch.tensor(half.faces).t())}, title="half"
    )
    browser.open(tmp_path / "page.html")
    browser.drag(97, 31)
    blue = []
    for _ in range(2):
        browser.click(f'[data-axis="{axis}"]')
        picture = np.concatenate(browser.view(), axis=1)
        drawn = abs(picture - picture[0, 0]).sum(axis=-1) > 30
        blue.append((picture[..., 2] > 1.2 * picture[..., 0])[drawn].mean())
    assert blue[0] < 0.01
    assert blue[1] > 0.9
    assert browser.faults() == []


def test_smooth_shading_hides_the_faces(browser, page):
    browser.open(page)

    def edges_seen():
        rows, columns = (slice(size // 2 - 60, size // 2 + 60) for size in browser.view()[1].shape[:2])
        return (np.abs(np.diff(browser.view()[1][rows, columns].sum(axis=-1), axis=1)) > 9).mean()

    flat = edges_seen()
    browser.click("#smooth")
    assert edges_seen() < flat / 3
    browser.click("#smooth")
    assert edges_seen() == pytest.approx(flat, rel=0.1)
    assert browser.faults() == []


def test_any_number_of_meshes_is_shown_side_by_side(browser, tmp_path, sphere_mesh, cube_mesh):
    meshes = {"ball <b>": sphere_mesh, "cube": cube_mesh, "ball again": sphere_mesh}
    write_view(tmp_path / "page.html", meshes, title="three")
    browser.open(tmp_path / "page.html")
    whole = np.concatenate(browser.view(), axis=1)
    for third in np.array_split(whole, 3, axis=1):
        assert (abs(third - whole[0, 0]).sum(axis=-1) > 30).mean() > 0.1
    labels = browser.evaluate("[...document.querySelectorAll('.label')].map(label => label.textContent).join()")
    assert labels["value"] == "ball <b>,cube,ball again"
    assert browser.evaluate("document.querySelectorAll('[data-layout], #strength').length")["value"] == 0
    assert browser.faults() == []
    with pytest.raises(ValueError, match=r"at least one mesh \(got none\)"):
        write_view(tmp_path / "page.html", {}, title="none")


def test_index_leads_to_the_pages(browser, tmp_path, sphere_mesh):
    pos, face = sphere_mesh
    name = "a #1 <b>%.ply"
    write_report(tmp_path / f"{name}.html", pos, pos, face, title="first")
    write_index(tmp_path / "index.html", {name: (f"{name}.html", ("320",))}, ("Faces",))
    browser.open(tmp_path / "index.html")
    assert "320" in browser.evaluate("document.querySelector('tbody').textContent")["value"]
    link = browser.evaluate("decodeURIComponent(document.querySelector('tbody a').href)")["value"]
    assert link == f"file://{tmp_path}/{name}.html"
    assert browser.evaluate("document.querySelector('tbody a').textContent")["value"] == name
    assert browser.faults() == []


def test_dark_and_narrow(browser, page):
    try:
        browser.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.send("Emulation.setDeviceMetricsOverride", width=420, height=900, deviceScaleFactor=1, mobile=False)
        browser.open(page)
        picture = browser.picture()
        assert picture[:5].mean() < 60
        assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth")["value"] is True
        assert browser.faults() == []
    finally:
        browser.send("Emulation.setEmulatedMedia", features=[])
        browser.send("Emulation.setDeviceMetricsOverride", **SIZE, deviceScaleFactor=1, mobile=False)


SCRIPT = """'"></title></script></td><script>document.title='run'</script><img src=x onerror="document.title='run'">"""


def test_names_from_files_are_text_and_never_run(browser, tmp_path, sphere_mesh):
    pos, face = sphere_mesh
    path = tmp_path / "page.html"
    write_report(
        path, pos, pos, face, title=f"title {SCRIPT}", subtitle=f"subtitle {SCRIPT}", reference=pos,
        figures={f"figure {SCRIPT}": (f"before {SCRIPT}", f"after {SCRIPT}")},
        settings={f"setting {SCRIPT}": f"value {SCRIPT}"},
    )  # fmt: skip
    browser.open(path)
    assert browser.evaluate("document.title")["value"] == f"title {SCRIPT}"
    assert browser.evaluate("document.scripts.length")["value"] == 2  # data and program
    assert browser.evaluate("document.querySelectorAll('img').length")["value"] == 1  # colours of the scale
    text = browser.evaluate("document.body.textContent")["value"]
    for name in ("title", "subtitle", "figure", "before", "after", "setting", "value"):
        assert f"{name} {SCRIPT}" in text
    assert browser.faults() == []


def test_scripts_that_are_not_the_page_own_are_refused(browser, page):
    text = page.read_text().replace("</main>", "</main><script>document.title = 'run'</script>")
    page.write_text(text)
    browser.open(page)
    assert browser.evaluate("document.title")["value"] == "a <b> & c.obj"
    browser.events.clear()  # the refusal is told in the console


def test_scan_turned_away_is_shown_from_its_front(browser, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] < 0)], append=True)
    pos, face = torch.tensor(half.vertices) + 5, torch.tensor(half.faces).t().contiguous()
    share = {}
    for name, corners in (("front", face), ("inside out", face.flip(0))):
        write_report(tmp_path / f"{name}.html", pos, pos, corners, title=name)
        browser.open(tmp_path / f"{name}.html")
        half_view = browser.view()[0]
        drawn = abs(half_view - half_view[0, 0]).sum(axis=-1) > 30
        share[name] = drawn.mean()
        blue = (half_view[..., 2] > 1.2 * half_view[..., 0])[drawn].mean()
        assert blue < 0.01, name  # both look at the viewer, as the camera follows the normals
    browser.drag(380, 0)  # about half a turn
    half_view = browser.view()[0]
    drawn = abs(half_view - half_view[0, 0]).sum(axis=-1) > 30
    assert (half_view[..., 2] > 1.2 * half_view[..., 0])[drawn].mean() > 0.8
    assert min(share.values()) > 0.25
    assert browser.faults() == []
