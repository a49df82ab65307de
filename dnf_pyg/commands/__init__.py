"""The commands of ``dnf-pyg``, a module each.

Those of :data:`COMMANDS` have ``add_arguments(parser)`` and ``run(options)``, those of :data:`LIGHTNING` parse their
words themselves: ``run(words)``.
"""

from dnf_pyg.commands import (
    add_noise,
    benchmark,
    compare,
    configs,
    denoise,
    experiment,
    make_shape,
    predict,
    train,
    weights,
)

__all__ = ["COMMANDS", "LIGHTNING"]

COMMANDS = {
    "denoise": (denoise, "denoise a mesh"),
    "compare": (compare, "measure a mesh against its clean reference"),
    "benchmark": (benchmark, "compare methods on a folder of test meshes"),
    "experiment": (experiment, "make the paper's tables and plots from trained networks"),
    "weights": (weights, "list the weights that come along, or publish new ones"),
    "add-noise": (add_noise, "add noise to a clean mesh"),
    "make-shape": (make_shape, "make a clean mesh in code"),
    "configs": (configs, "list and copy the configs that come along"),
}

LIGHTNING = {
    "fit": (train, "train a network from a config (LightningCLI)"),
    "validate": (train, "evaluate a checkpoint on the validation patches"),
    "test": (train, "evaluate a checkpoint on the test patches"),
    "predict": (predict, "denoise many meshes, on several processes or machines"),
}
