"""The page for denoising in the browser: used in Chromium, and over HTTP as its own script does."""

import os
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import torch
import trimesh

from dnf_pyg import FAST, UpdateOptions, denoise
from dnf_pyg.commands.view_options import ServeOptions
from dnf_pyg.errors import OptionError
from dnf_pyg.io import read_mesh
from dnf_pyg.nn import DNFNet

pytest.importorskip("gradio", reason='needs the extra "serve": pip install ".[serve]"')
gradio_client = pytest.importorskip("gradio_client")
httpx = pytest.importorskip("httpx")

SETTINGS = (0.5, 1, True, True)  # strength, passes, fast, keep boundaries


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    from dnf_pyg.commands.serve import serving

    torch.manual_seed(0)
    weights = tmp_path_factory.mktemp("weights")
    DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8).save_pretrained(weights)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GRADIO_TEMP_DIR", "")  # set by the server, and as before afterwards
        with serving(ServeOptions(weights=str(weights), max_megabytes=1, device="cpu")) as served:
            served.weights = weights
            yield served


@pytest.fixture
def client(app, tmp_path):
    return gradio_client.Client(app.local_url, verbose=False, download_files=tmp_path / "downloads")


@pytest.fixture
def noisy(tmp_path):
    path = tmp_path / "noisy.ply"
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.vertices += 0.03 * torch.randn(mesh.vertices.shape, generator=torch.Generator().manual_seed(0)).numpy()
    mesh.export(path)
    return path


def refusal(client, upload):
    with pytest.raises(Exception) as raised:  # noqa: PT011 - Gradio's client raises several kinds
        client.predict(upload, *SETTINGS, api_name="/denoise")
    return str(raised.value)


def answer(app, path, **others):
    """What the server says about a path that is named as if it were an upload."""
    upload = {"path": str(path), "meta": {"_type": "gradio.FileData"}, **others}
    place = f"{app.local_url}gradio_api/call/denoise"
    event = httpx.post(place, json={"data": [upload, *SETTINGS]}).json()["event_id"]
    return httpx.get(f"{place}/{event}", timeout=None).text


def test_upload_is_denoised_shown_and_downloaded(app, client, noisy):
    page, output = client.predict(gradio_client.handle_file(noisy), *SETTINGS, api_name="/denoise")
    expected = denoise(
        read_mesh(noisy), app.weights, filtering=FAST, update=UpdateOptions(strength=0.5, preserve_boundary=True)
    )
    result = read_mesh(output)
    assert Path(output).name == "noisy_denoised.ply"
    torch.testing.assert_close(result.pos, expected.pos, atol=1e-6, rtol=0)  # the file has single precision
    assert torch.equal(result.face, expected.face)
    assert page.startswith("<iframe srcdoc=")
    assert "noisy.ply, denoised" in page


@pytest.mark.parametrize("width", [390, 1400])
def test_in_chromium_upload_options_view_and_download(app, browser, noisy, tmp_path, width):
    browser.resize(width=width)
    browser.open(app.local_url)
    browser.wait(lambda: browser.holds("document.querySelector('input[type=file]') !== null"))
    assert browser.holds("document.documentElement.scrollWidth <= innerWidth")
    root = browser.send("DOM.getDocument")["root"]["nodeId"]
    chosen = browser.send("DOM.querySelector", nodeId=root, selector="input[type=file]")["nodeId"]
    browser.send("DOM.setFileInputFiles", nodeId=chosen, files=[str(noisy)])
    browser.wait(lambda: browser.holds("document.querySelector('a[download=\"noisy.ply\"]') !== null"))
    for label in ("Fast", "Keep open boundaries in place"):
        browser.evaluate(f"[...document.querySelectorAll('label')].find(l => l.innerText.includes('{label}')).click()")
    browser.evaluate("[...document.querySelectorAll('button')].find(b => b.innerText === 'Denoise').click()")
    browser.wait(lambda: browser.holds("document.querySelector('iframe') !== null"))
    shown = "document.querySelector('iframe').contentDocument"
    browser.wait(lambda: browser.holds(f"{shown}.readyState === 'complete' && {shown}.title === 'noisy.ply, denoised'"))
    assert browser.holds(f"{shown}.getElementById('failure').hidden")
    browser.send("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path / "saved"))
    browser.click('a[download="noisy_denoised.ply"]')
    saved = tmp_path / "saved" / "noisy_denoised.ply"
    browser.wait(saved.is_file)
    update = UpdateOptions(preserve_boundary=True)
    expected = denoise(read_mesh(noisy), app.weights, filtering=FAST, update=update)
    torch.testing.assert_close(read_mesh(saved).pos, expected.pos, atol=1e-6, rtol=0)
    assert browser.faults(own=("file:", "data:", "blob:", app.local_url)) == []
    browser.resize()


@pytest.mark.parametrize(("name", "told"), [("a.ply", "it does not begin with 'ply'"), ("a.obj", "Expected a mesh")])
def test_faults_of_the_upload_are_told_without_its_folder(name, told, client, tmp_path):
    (tmp_path / name).write_text("no mesh")
    message = refusal(client, gradio_client.handle_file(tmp_path / name))
    assert told in message
    assert name in message
    assert "/" not in message.split("got")[1]


def test_nothing_uploaded_is_told(client):
    assert refusal(client, None) == "Expected an uploaded mesh (got none). Upload one."


def test_no_file_but_an_upload_is_opened(app, noisy):
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    uploaded = Path(httpx.post(f"{app.local_url}gradio_api/upload", files={"files": noisy.open("rb")}).json()[0])
    url = f"http://127.0.0.1:{server.server_port}/mesh.ply"
    around = uploaded.parent / Path(*[".."] * len(uploaded.parent.parts)) / noisy.relative_to("/")
    absent = uploaded.with_name("absent.ply")
    assert around.is_file()
    for path in (noisy, around, url, uploaded.parent, absent):
        assert answer(app, path).startswith("event: error"), path
    for path in (url, absent):
        assert "Expected an uploaded mesh (got none). Upload one." in answer(app, path)
        assert "Expected an uploaded mesh (got none). Upload one." in answer(app, path, is_stream=True)
    server.shutdown()
    assert asked == []
    for path in (noisy, around):
        assert httpx.get(f"{app.local_url}gradio_api/file={path}").status_code in (403, 404)
    assert "noisy.ply, denoised" in answer(app, uploaded)


def test_large_files_are_refused(app, tmp_path):
    (tmp_path / "large.ply").write_bytes(bytes(1_100_000))
    with (tmp_path / "large.ply").open("rb") as file:
        answer = httpx.post(f"{app.local_url}gradio_api/upload", files={"files": file})
    assert answer.status_code == 413


def test_page_is_for_this_computer_and_loads_nothing_from_elsewhere(app):
    assert urlsplit(app.local_url).hostname == "127.0.0.1"
    page = httpx.get(app.local_url).text + httpx.get(f"{app.local_url}theme.css").text
    assert "fonts.googleapis" not in page
    assert app.share_url is None
    assert not app.analytics_enabled


def test_address_that_is_taken_and_end_of_files(app, noisy, monkeypatch):
    from dnf_pyg.commands.serve import serving

    monkeypatch.setenv("GRADIO_TEMP_DIR", os.environ["GRADIO_TEMP_DIR"])  # that of ``app`` again, at the end
    port = urlsplit(app.local_url).port
    with pytest.raises(OptionError, match=f"got 127.0.0.1:{port}: "), serving(_options(app, port=port)):
        pass
    with serving(_options(app)) as other:
        upload = httpx.post(f"{other.local_url}gradio_api/upload", files={"files": noisy.open("rb")}).json()[0]
        assert Path(upload).is_file()
    assert not Path(upload).parents[1].exists()


def test_device_that_is_not_there(app):
    from dnf_pyg.commands.serve import serving

    with pytest.raises(OptionError, match="Expected a device of this machine"):
        serving(_options(app, device="cuda:99")).__enter__()


def _options(app, **others):
    return ServeOptions(weights=str(app.weights), **others)
