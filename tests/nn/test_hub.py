"""Weights go to the Hugging Face hub and come back, through its own client; a server here stands in for it."""

import base64
import hashlib
import json
import os
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
import torch

from dnf_pyg.nn import DNFNet

COMMIT = "0123456789" * 4


class Hub(BaseHTTPRequestHandler):
    """The requests of ``create_repo``, ``upload_folder`` and ``snapshot_download``, for one repository."""

    def answer(self, body=b"", status=200, **headers):
        body = body if isinstance(body, bytes) else json.dumps(body).encode()
        self.send_response(status)
        for name, value in {"Content-Length": len(body), "X-Repo-Commit": COMMIT, **headers}.items():
            self.send_header(name.replace("_", "-"), str(value))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def do_POST(self):
        text = self.rfile.read(int(self.headers["Content-Length"]))
        if self.path == "/api/repos/create":
            self.server.created.append(json.loads(text)["name"])
            self.answer({"url": f"http://{self.headers['Host']}/user/net"})
        elif self.path.startswith("/api/models/user/net/preupload/"):
            files = [
                {"path": file["path"], "uploadMode": "regular", "shouldIgnore": False}
                for file in json.loads(text)["files"]
            ]
            self.answer({"files": files})
        elif self.path.startswith("/api/models/user/net/commit/"):
            for entry in map(json.loads, text.splitlines()):
                if entry["key"] == "file":
                    self.server.files[entry["value"]["path"]] = base64.b64decode(entry["value"]["content"])
            self.answer({"commitUrl": f"http://{self.headers['Host']}/user/net/commit/{COMMIT}", "commitOid": COMMIT})
        else:
            self.answer({"error": "unknown"}, 404)

    def do_GET(self):
        name = self.path.rpartition("/")[2]
        if self.path.startswith("/api/models/user/net/revision/"):
            self.answer(
                {"id": "user/net", "sha": COMMIT, "siblings": [{"rfilename": path} for path in self.server.files]}
            )
        elif self.path.startswith("/api/models/user/net/tree/"):
            files = self.server.files.items()
            self.answer([{"type": "file", "path": path, "size": len(data), "oid": COMMIT} for path, data in files])
        elif self.path.startswith("/user/net/resolve/") and name in self.server.files:
            content = self.server.files[name]
            self.answer(content, ETag=f'"{hashlib.sha256(content).hexdigest()}"')
        else:
            self.answer({"error": "unknown"}, 404, X_Error_Code="RepoNotFound")

    do_HEAD = do_GET

    def log_message(self, *args):
        """Tell nothing."""


@pytest.fixture
def hub():
    server = ThreadingHTTPServer(("127.0.0.1", 0), Hub)
    server.files, server.created = {}, []
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def python(hub, folder, code):
    environment = {
        **os.environ,
        "HF_ENDPOINT": f"http://127.0.0.1:{hub.server_port}", "HF_HOME": str(folder),
        "HF_TOKEN": "hf_none",
        "HF_HUB_DISABLE_XET": "1", "HF_HUB_DISABLE_TELEMETRY": "1", "NO_PROXY": "127.0.0.1", "no_proxy": "127.0.0.1",
    }  # fmt: skip
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)


def test_weights_go_to_the_hub_and_come_back(hub, tmp_path):
    torch.manual_seed(0)
    net = DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8).eval()
    net.save_pretrained(tmp_path / "net")
    (tmp_path / "net" / "card.txt").write_text("what it is for")
    code = f"from dnf_pyg.nn import DNFNet\nnet = DNFNet.from_pretrained({str(tmp_path / 'net')!r})\n"
    done = python(hub, tmp_path / "home", f"{code}net.push_to_hub('user/net', {str(tmp_path / 'net')!r})")
    assert done.returncode == 0, done.stderr
    assert hub.created == ["net"]
    assert set(hub.files) == {"config.json", "model.safetensors", "card.txt"}

    code = f"import dnf_pyg\ndnf_pyg.load_network('hf://user/net').save_pretrained({str(tmp_path / 'back')!r})"
    done = python(hub, tmp_path / "other", code)
    assert done.returncode == 0, done.stderr
    torch.testing.assert_close(DNFNet.from_pretrained(tmp_path / "back").state_dict(), net.state_dict(), rtol=0, atol=0)
    assert not list((tmp_path / "other").rglob("card.txt"))

    done = python(hub, tmp_path / "third", "import dnf_pyg\ndnf_pyg.load_network('hf://user/absent')")
    assert "WeightsError: Expected a repository of the Hugging Face hub (got 'user/absent'" in done.stderr
