"""Networks as folders of ``config.json`` and ``model.safetensors``."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self, cast

from safetensors import SafetensorError
from safetensors.torch import load, save_file

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn.config import build_networks, describe_networks

if TYPE_CHECKING:
    from dnf_pyg.nn.cascade import Cascade
    from dnf_pyg.nn.network import FilteringNetwork

__all__ = ["Pretrained", "download_folder", "packaged_weights", "read_folder"]

_CONFIG, _TENSORS = "config.json", "model.safetensors"
_METRICS = "metrics.json"  # beside released weights: their checksum, among other things
_PACKAGED = Path(__file__).parents[1] / "weights"


def packaged_weights() -> dict[str, Path]:
    """Name and folder of every set of weights that the package carries."""
    return {path.parent.name: path.parent for path in sorted(_PACKAGED.glob(f"*/{_TENSORS}"))}


def read_folder(folder: Path) -> list["FilteringNetwork"]:
    """Read the networks of a folder: one, or those of a cascade. No code in a file is ever run.

    Raises:
        WeightsError: If a file is missing or damaged, describes no network, or differs from the checksum of a release.
    """
    missing = [name for name in (_CONFIG, _TENSORS) if not (folder / name).is_file()]
    if missing:
        raise WeightsError(
            f"Expected a folder of weights (got '{folder}' without {', '.join(missing)}). Give one that "
            "`dnf-pyg weights export` or `save_pretrained` wrote."
        )
    try:
        description = json.loads((folder / _CONFIG).read_text(encoding="utf-8"))
        content = (folder / _TENSORS).read_bytes()
        state = load(content)
        metrics = json.loads((folder / _METRICS).read_text(encoding="utf-8")) if (folder / _METRICS).is_file() else {}
    except (OSError, ValueError, RecursionError, SafetensorError) as error:
        raise WeightsError(
            f"Expected readable weights (got '{folder}': {str(error).splitlines()[0]}). Copy them again."
        ) from error
    expected = metrics.get("sha256") if isinstance(metrics, dict) else None
    found = hashlib.sha256(content).hexdigest()
    if expected not in (None, found):
        raise WeightsError(
            f"Expected tensors with the sha256 of their release, {expected} (got {found} in '{folder}'). Copy the "
            "weights again."
        )
    return build_networks(description, state, str(folder))


def download_folder(repo_id: str, revision: str | None = None) -> Path:
    """Download the weights of a repository of the Hugging Face hub.

    Args:
        repo_id: Repository, ``user/name``.
        revision: Branch, tag or commit; the main branch if not given.

    Raises:
        WeightsError: If there is no such repository, or the hub cannot be reached.
    """
    from huggingface_hub import snapshot_download  # takes a while to import

    try:
        return Path(snapshot_download(repo_id, revision=revision, allow_patterns=[_CONFIG, _TENSORS, _METRICS]))
    except (OSError, ValueError) as error:  # all errors of the hub are of these types
        raise WeightsError(
            f"Expected a repository of the Hugging Face hub (got '{repo_id}': {str(error).splitlines()[0]}). Check "
            "its name and the connection."
        ) from error


class Pretrained:
    """Mixin of networks that are written to and read from folders, and shared on the Hugging Face hub.

    ``config.json`` holds the version of the format, the class of the network, its constructor arguments and the noise
    levels of its training data, for a cascade those of each network; ``model.safetensors`` holds the tensors.
    """

    @classmethod
    def of_networks(cls, networks: Sequence["FilteringNetwork"]) -> Self | None:
        """Take the networks of a folder as an object of this class; ``None`` where they are something else."""
        return networks[0] if len(networks) == 1 and isinstance(networks[0], cls) else None

    def save_pretrained(self, folder: str | Path) -> None:
        """Write the network into a folder, which is made if it does not exist.

        Raises:
            WeightsError: If the folder cannot be written.
        """
        networks, folder = cast("FilteringNetwork | Cascade", self).networks, Path(folder)
        module = networks[0] if len(networks) == 1 else cast("Cascade", self)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            save_file({name: value.contiguous() for name, value in module.state_dict().items()}, folder / _TENSORS)
            (folder / _CONFIG).write_text(json.dumps(describe_networks(networks), indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            raise WeightsError(
                f"Expected a folder that can be written (got '{folder}': {error.strerror}). Choose another one."
            ) from error

    @classmethod
    def from_pretrained(cls, name: str | Path, revision: str | None = None) -> Self:
        """Read a network of this class from packaged weights, a folder or the Hugging Face hub, in this order.

        Args:
            name: Name of packaged weights, a folder, or a repository ``user/name`` of the hub.
            revision: Branch, tag or commit of the repository; the main branch if not given.

        Returns:
            The network in evaluation mode, on the CPU.

        Raises:
            WeightsError: If there are no such weights, or they are damaged or of another class.
        """
        folder = packaged_weights().get(str(name), Path(name))
        networks = read_folder(folder if folder.is_dir() else download_folder(str(name), revision))
        found = cls.of_networks(networks)
        if found is None:
            kind = "Cascade" if len(networks) > 1 else type(networks[0]).__name__
            raise WeightsError(
                f"Expected weights of a {cls.__name__} (got '{name}', a {kind}). Call `{kind}.from_pretrained`."
            )
        return found

    def push_to_hub(self, repo_id: str, folder: str | Path, commit_message: str | None = None) -> None:
        """Write the network into a folder and upload the folder to a repository of the Hugging Face hub.

        Args:
            repo_id: Repository, ``user/name``, which is made if it does not exist.
            folder: Folder to write and upload, with the model card that it may hold.
            commit_message: Message of the commit; one of the hub's if not given.
        """
        from huggingface_hub import HfApi  # takes a while to import

        self.save_pretrained(folder)
        HfApi().create_repo(repo_id, exist_ok=True)
        HfApi().upload_folder(repo_id=repo_id, folder_path=str(folder), commit_message=commit_message)
