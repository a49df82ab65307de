"""Fast evaluation and training of the grouping layers.

A grouping layer is the max over the edges of a centre of an MLP. Done as ordinary message passing, every layer of the
MLP writes an array of all edges. The modules of this package compute the same numbers in blocks of centres whose arrays
stay in the cache, and keep little for the backward pass:

- :mod:`~dnf_pyg.nn.kernels.rows` groups edges by centre, centres of equal degree side by side, and cuts them into
  blocks.
- :mod:`~dnf_pyg.nn.kernels.edge_mlp` removes batch normalization from the MLP: in evaluation it is folded into the
  linear layers, in training it is computed from the moments of the edges.
- :mod:`~dnf_pyg.nn.kernels.fused` runs the folded MLP and the max block by block, for evaluation without gradients.
- :mod:`~dnf_pyg.nn.kernels.recompute` does so for training: the backward pass computes activations again.
- :mod:`~dnf_pyg.nn.kernels.segment` reduces the rows of consecutive segments.

:class:`~dnf_pyg.nn.NormalGroupingConv` says when a layer uses them and when it is ordinary message passing.
"""

__all__: list[str] = []
