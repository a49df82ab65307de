"""The commands of ``dnf-pyg``, a module each: ``add_arguments(parser)`` and ``run(options)``."""

from dnf_pyg.commands import add_noise, benchmark, compare, configs, denoise, make_shape, train, weights

__all__ = ["COMMANDS", "TRAINING", "train"]

COMMANDS = {
    "denoise": (denoise, "denoise a mesh"),
    "compare": (compare, "measure a mesh against its clean reference"),
    "benchmark": (benchmark, "compare methods on a folder of test meshes"),
    "weights": (weights, "list the weights that come along, or publish new ones"),
    "add-noise": (add_noise, "add noise to a clean mesh"),
    "make-shape": (make_shape, "make a clean mesh in code"),
    "configs": (configs, "list and copy the configs that come along"),
}

TRAINING = {
    "fit": "train a network from a config (LightningCLI)",
    "validate": "evaluate a checkpoint on the validation patches",
    "test": "evaluate a checkpoint on the test patches",
    "predict": "run a checkpoint over the patches of a data module",
}
