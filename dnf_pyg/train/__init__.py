"""Training: module, losses, distillation, callbacks, prediction of many files."""

__all__: list[str] = []
