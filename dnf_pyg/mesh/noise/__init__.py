"""Noise models for meshes; their levels are multiples of the mean edge length."""

from dnf_pyg.mesh.noise.correlated import CorrelatedNoise, RayNoise, ScanNoise, correlated_field
from dnf_pyg.mesh.noise.mixed import NOISE_KINDS, MixedNoise
from dnf_pyg.mesh.noise.model import Noise
from dnf_pyg.mesh.noise.white import GaussianNoise, GaussianNormalNoise, ImpulsiveNoise, UniformNoise

__all__ = [
    "NOISE_KINDS",
    "CorrelatedNoise",
    "GaussianNoise",
    "GaussianNormalNoise",
    "ImpulsiveNoise",
    "MixedNoise",
    "Noise",
    "RayNoise",
    "ScanNoise",
    "UniformNoise",
    "correlated_field",
]
