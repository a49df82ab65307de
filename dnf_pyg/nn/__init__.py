"""Layers of the deep normal filtering network, the network itself, and the network of the released weights."""

from dnf_pyg.nn.attention import ChannelAttention
from dnf_pyg.nn.bilateral import JointBilateralConv
from dnf_pyg.nn.cascade import Cascade
from dnf_pyg.nn.dnf_net import DNFNet
from dnf_pyg.nn.embedding import MultiScaleEmbedding
from dnf_pyg.nn.grouping import FeatureGroupingConv, NormalGroupingConv, SurfaceGroupingConv
from dnf_pyg.nn.head import NormalHead
from dnf_pyg.nn.neighbors import feature_neighbors, nearest_edges
from dnf_pyg.nn.network import FilteringNetwork
from dnf_pyg.nn.residual import ResidualUnit
from dnf_pyg.nn.surface_dnf_net import SurfaceDNFNet
from dnf_pyg.nn.surface_embedding import SurfaceEmbedding

__all__ = [
    "Cascade",
    "ChannelAttention",
    "DNFNet",
    "FeatureGroupingConv",
    "FilteringNetwork",
    "JointBilateralConv",
    "MultiScaleEmbedding",
    "NormalGroupingConv",
    "NormalHead",
    "ResidualUnit",
    "SurfaceDNFNet",
    "SurfaceEmbedding",
    "SurfaceGroupingConv",
    "feature_neighbors",
    "nearest_edges",
]
