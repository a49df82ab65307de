"""Denoise meshes in the browser: a page to upload them, to set options, to see the result in 3D and to download it."""

import os
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

from dnf_pyg.commands.denoise import check_device
from dnf_pyg.commands.terminal import printable, tell
from dnf_pyg.commands.view_options import ServeOptions
from dnf_pyg.errors import DNFError, OptionError
from dnf_pyg.io import SUFFIXES, read_mesh
from dnf_pyg.nn import Cascade
from dnf_pyg.options import FAST, FilterOptions, UpdateOptions
from dnf_pyg.pipeline import denoise
from dnf_pyg.view import PageView
from dnf_pyg.weights.load import load_cascade

__all__ = ["run", "serving"]

_FONT = "system-ui"  # that of the theme comes from Google
_CLEANING = (600, 3600)  # seconds between two deletions of files, and age from which files are deleted
_WAITING = 16  # requests; one is worked on at a time


def run(options: ServeOptions) -> None:
    """Serve the page until the program is interrupted.

    Raises:
        OptionError: If the address cannot be listened on, or this machine has no such device.
        WeightsError: If the weights cannot be loaded.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # files are deleted then, too
    with serving(options) as app:
        tell(f"{app.local_url} is ready. Ctrl+C ends it.")
        app.block_thread()


@contextmanager
def serving(options: ServeOptions) -> Iterator[Any]:
    """Serve the page while the block runs; uploads and results are deleted at its end.

    Args:
        options: Address, limits and network.

    Yields:
        The Gradio app.

    Raises:
        OptionError: If the address cannot be listened on, or this machine has no such device.
        WeightsError: If the weights cannot be loaded.
    """
    import gradio as gr  # an extra

    check_device(options.device)
    cascade = load_cascade(options.weights)
    with tempfile.TemporaryDirectory(prefix="dnf_pyg_") as folder:
        os.environ["GRADIO_TEMP_DIR"] = folder
        app = _page(cascade, options.device, Path(folder).resolve())
        app.queue(max_size=_WAITING)
        try:
            app.launch(
                server_name=options.host,
                server_port=options.port,
                max_file_size=f"{options.max_megabytes}mb",
                theme=gr.themes.Default(primary_hue="blue", font=_FONT, font_mono=_FONT),
                share=False, ssr_mode=False, mcp_server=False, pwa=False, run_history=False, enable_monitoring=False,
                footer_links=[], quiet=True, prevent_thread_lock=True,
            )  # fmt: skip
        except OSError as error:
            place = f"{options.host}:{options.port or 'any'}"
            raise OptionError(
                f"Expected an address to listen on (got {place}: {error}). Choose another --host or --port."
            ) from error
        try:
            yield app
        finally:
            app.close()


def _page(cascade: Cascade, device: str, folder: Path) -> Any:
    """The app; ``folder`` is where Gradio keeps what is uploaded."""
    import gradio as gr

    def uploaded(path: str | None) -> Path:
        """An upload, which is the only file that a client can name."""
        found = Path(path or "").resolve()
        if not path or not found.is_relative_to(folder) or not found.is_file():
            raise gr.Error("Expected an uploaded mesh (got none). Upload one.", print_exception=False)
        return found

    progress = gr.Progress()

    async def kept(path: str) -> str:
        return str(uploaded(path))

    def denoised(
        upload: str | None, strength: float, num_passes: int, fast: bool, preserve_boundary: bool
    ) -> Iterator[tuple[str, str]]:
        path = uploaded(upload)
        try:
            result = denoise(
                read_mesh(path),
                cascade,
                filtering=replace(FAST if fast else FilterOptions(), device=device),
                update=UpdateOptions(strength=strength, preserve_boundary=preserve_boundary),
                num_passes=num_passes,
                progress=lambda done, total: progress((done, total), unit="faces"),
            )
            with tempfile.TemporaryDirectory() as made:
                output, page = Path(made) / f"{path.stem}_denoised{path.suffix}", Path(made) / "report.html"
                result.save(output)
                result.report(page, title=f"{path.name}, denoised")
                yield PageView(page, height=1000)._repr_html_(), str(output)  # Gradio copies the file meanwhile
        except DNFError as error:
            message = printable(error).replace(str(path), path.name)
            raise gr.Error(escape(message, quote=False), duration=None, print_exception=False) from error

    with gr.Blocks(title="dnf_pyg", analytics_enabled=False, delete_cache=_CLEANING, fill_width=True) as app:
        with gr.Row():
            with gr.Column(scale=1, min_width=260):
                upload: Any = gr.File(label="Noisy mesh", file_types=[*SUFFIXES], height=150)
                # Gradio itself would fetch a URL that a client names
                upload.async_move_resource_to_block_cache = kept
                strength = gr.Slider(0, 1, 1, step=0.05, label="Strength", info="Share of the full movement")
                passes = gr.Slider(1, 4, 1, step=1, label="Passes", info="Two suit strong noise on smooth surfaces")
                fast = gr.Checkbox(label="Fast", info="Half of the time for 0.03 degrees on average")
                boundary = gr.Checkbox(label="Keep open boundaries in place")
                button = gr.Button("Denoise", variant="primary")
                output = gr.File(label="Denoised mesh", interactive=False, height=90)
            with gr.Column(scale=3, min_width=320):
                page = gr.HTML("<p>The mesh before and after appears here.</p>")
        button.click(denoised, [upload, strength, passes, fast, boundary], [page, output], api_name="denoise")
    return app
