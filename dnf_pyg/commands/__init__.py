"""The commands of ``dnf-pyg``; what a command works with is imported when it runs."""

from typing import Any, NamedTuple

from dnf_pyg.commands import evaluation_options, options, shape_options, view_options

__all__ = ["COMMANDS", "LIGHTNING", "Command"]


class Command(NamedTuple):
    """A command whose arguments are the fields of a dataclass.

    Attributes:
        options: The dataclass.
        work: Import path of the function that takes it.
        needs: A package that only this command needs, and the extra of dnf-pyg that installs it.
    """

    options: type[Any]
    work: str
    needs: tuple[str, str] | None = None


COMMANDS = {
    "demo": Command(shape_options.DemoOptions, "dnf_pyg.commands.demo:run"),
    "denoise": Command(options.DenoiseOptions, "dnf_pyg.commands.denoise:run"),
    "view": Command(view_options.ViewOptions, "dnf_pyg.commands.view:run"),
    "serve": Command(view_options.ServeOptions, "dnf_pyg.commands.serve:run", needs=("gradio", "serve")),
    "compare": Command(options.CompareOptions, "dnf_pyg.commands.compare:run"),
    "benchmark": Command(evaluation_options.BenchmarkOptions, "dnf_pyg.commands.benchmark:run"),
    "experiment ablation": Command(evaluation_options.AblationOptions, "dnf_pyg.commands.experiment:ablation"),
    "experiment series": Command(evaluation_options.SeriesOptions, "dnf_pyg.commands.experiment:series"),
    "weights": Command(options.WeightsOptions, "dnf_pyg.commands.weights:run"),
    "weights export": Command(options.ExportOptions, "dnf_pyg.commands.export_weights:run"),
    "add-noise": Command(shape_options.AddNoiseOptions, "dnf_pyg.commands.add_noise:run"),
    "make-shape": Command(shape_options.MakeShapeOptions, "dnf_pyg.commands.make_shape:run"),
    "configs": Command(options.ConfigsOptions, "dnf_pyg.commands.configs:run"),
    "completion": Command(options.CompletionOptions, "dnf_pyg.commands.completion:run"),
}

LIGHTNING = {  # these parse their words themselves, with the options of Lightning
    "fit": ("dnf_pyg.commands.train:run", "Train a network from a config (LightningCLI)"),
    "validate": ("dnf_pyg.commands.train:run", "Evaluate a checkpoint on the validation patches"),
    "test": ("dnf_pyg.commands.train:run", "Evaluate a checkpoint on the test patches"),
    "predict": ("dnf_pyg.commands.predict:run", "Denoise many meshes on several processes or machines"),
}
