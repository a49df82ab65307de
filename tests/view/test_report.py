"""The report page in a real browser, without network."""

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.view import write_index, write_report, write_view


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
    browser.open(page.as_uri())
    before, after = browser.view()
    assert share_drawn(before) > 0.25
    assert share_drawn(after) > 0.25
    assert difference(before[:, : after.shape[1]], after[:, : before.shape[1]]) > 1  # noisy and smooth
    assert browser.evaluate("document.title")["value"] == "a <b> & c.obj"
    assert browser.faults() == []


def test_drag_turns_both_meshes_and_reset_turns_them_back(browser, page):
    browser.open(page.as_uri())
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
    browser.open(page.as_uri())
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
    browser.open(page.as_uri() + "#moved")
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
    browser.open(page.as_uri() + "#swipe")
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
    browser.open(page.as_uri() + "#blink")
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
    browser.open((tmp_path / "page.html").as_uri())
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
    saved = tmp_path / "ball.ply_denoised_0.25.ply"
    browser.wait(saved.is_file)
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
    browser.open((tmp_path / "page.html").as_uri())
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
    browser.open(page.as_uri())

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
    browser.open((tmp_path / "page.html").as_uri())
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
    browser.open((tmp_path / "index.html").as_uri())
    assert browser.holds("getComputedStyle(document.querySelector('thead')).display !== 'none'")
    assert "320" in browser.evaluate("document.querySelector('tbody').textContent")["value"]
    link = browser.evaluate("decodeURIComponent(document.querySelector('tbody a').href)")["value"]
    assert link == f"file://{tmp_path}/{name}.html"
    assert browser.evaluate("document.querySelector('tbody a').textContent")["value"] == name
    assert browser.faults() == []


def test_narrow_index_shows_names_and_figures_without_scrolling(browser, tmp_path):
    rows = {f"{'scan_of_a_part_' * 4}{number}.ply": (f"{number}.html", ("12,060", "0.165")) for number in range(2)}
    write_index(tmp_path / "index.html", rows, ("Faces", "Noise level"))
    try:
        browser.resize(width=390)
        browser.open((tmp_path / "index.html").as_uri())
        assert browser.holds("[...document.querySelectorAll('th, td')].every(e => e.scrollWidth <= e.clientWidth)")
        assert browser.holds("document.documentElement.scrollWidth <= innerWidth")
        assert browser.holds("document.querySelector('tbody a').getBoundingClientRect().width > 250")
        label = "getComputedStyle(document.querySelectorAll('tbody td')[1], '::before').content"
        assert browser.evaluate(label)["value"] == '"Noise level"'
    finally:
        browser.resize()


def test_dark_and_narrow(browser, page):
    try:
        browser.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.resize(width=390)
        browser.open(page.as_uri())
        picture = browser.picture()
        assert picture[:5].mean() < 60
        assert browser.holds("document.documentElement.scrollWidth <= innerWidth")
        assert browser.faults() == []
    finally:
        browser.send("Emulation.setEmulatedMedia", features=[])
        browser.resize()


SCRIPT = """'"></title></script></td><script>document.title='run'</script><img src=x onerror="document.title='run'">"""


def test_names_from_files_are_text_and_never_run(browser, tmp_path, sphere_mesh):
    pos, face = sphere_mesh
    path = tmp_path / "page.html"
    write_report(
        path, pos, pos, face, title=f"title {SCRIPT}", subtitle=f"subtitle {SCRIPT}", reference=pos,
        figures={f"figure {SCRIPT}": (f"before {SCRIPT}", f"after {SCRIPT}")},
        settings={f"setting {SCRIPT}": f"value {SCRIPT}"},
    )  # fmt: skip
    browser.open(path.as_uri())
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
    browser.open(page.as_uri())
    assert browser.evaluate("document.title")["value"] == "a <b> & c.obj"
    browser.events.clear()  # the refusal is told in the console


def test_scan_turned_away_is_shown_from_its_front(browser, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] < 0)], append=True)
    pos, face = torch.tensor(half.vertices) + 5, torch.tensor(half.faces).t().contiguous()
    share = {}
    for name, corners in (("front", face), ("inside out", face.flip(0))):
        write_report(tmp_path / f"{name}.html", pos, pos, corners, title=name)
        browser.open((tmp_path / f"{name}.html").as_uri())
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
