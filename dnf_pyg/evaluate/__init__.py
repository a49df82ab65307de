"""Measuring: metrics, classical filters, benchmark, the experiments of the paper."""

__all__: list[str] = []
