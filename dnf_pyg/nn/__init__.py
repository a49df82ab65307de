"""Layers of the deep normal filtering network, and the network itself."""

from dnf_pyg.nn.attention import ChannelAttention
from dnf_pyg.nn.bilateral import JointBilateralConv
from dnf_pyg.nn.dnf_net import DNFNet
from dnf_pyg.nn.embedding import MultiScaleEmbedding
from dnf_pyg.nn.grouping import FeatureGroupingConv, NormalGroupingConv, SurfaceGroupingConv
from dnf_pyg.nn.neighbors import feature_neighbors
from dnf_pyg.nn.residual import ResidualUnit
from dnf_pyg.nn.subsample import spread_neighbors, subsample_neighbors

__all__ = [
    "ChannelAttention",
    "DNFNet",
    "FeatureGroupingConv",
    "JointBilateralConv",
    "MultiScaleEmbedding",
    "NormalGroupingConv",
    "ResidualUnit",
    "SurfaceGroupingConv",
    "feature_neighbors",
    "spread_neighbors",
    "subsample_neighbors",
]
