import copy

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
from dnf_pyg.nn.config import build_network, check_same_network, describe_network

SMALL = {"k": [2, 4, 6], "residual_k": 3, "channels": [8, 8, 16], "embedding_channels": 8}


def flags(**changes):
    """The description of version 1."""
    return {
        **SMALL,
        "num_units": 2,
        "subtract": True,
        "align": False,
        "surface": False,
        "bilateral_iterations": 0,
    } | changes


@pytest.mark.parametrize("cls", [DNFNet, SurfaceDNFNet])
def test_round_trip(cls):
    net = cls(**SMALL)
    net.noise_range, net.random_rotation = (0.1, 0.3), True
    built = build_network(describe_network(net), net.state_dict(), "here")
    assert type(built) is cls
    assert not built.training
    assert (built.arguments, built.noise_range, built.random_rotation) == (net.arguments, (0.1, 0.3), True)
    torch.testing.assert_close(built.state_dict(), net.state_dict(), rtol=0, atol=0)


def test_descriptions_of_version_1():
    net = DNFNet(**SMALL)
    assert type(build_network(flags(), net.state_dict(), "here")) is DNFNet
    net = SurfaceDNFNet(**SMALL, bilateral_iterations=3)
    old = flags(align=True, surface=True, bilateral_iterations=3)
    built = build_network(old, net.state_dict(), "here")
    assert type(built) is SurfaceDNFNet
    assert built.bilateral_iterations == 3


def described(**changes):
    return {**describe_network(DNFNet(**SMALL)), **changes}


@pytest.mark.parametrize(
    ("description", "message"),
    [
        (None, "a description of a network"),
        ([1], "a description of a network"),
        (described(version=3), "'version' 2"),
        (described(network="os.system"), "'network' to be one of DNFNet"),
        (described(network=["DNFNet"]), "'network' to be one of DNFNet"),
        (described(arguments=None), "'arguments' by name"),
        (described(arguments={"shell": 1}), "arguments of DNFNet"),
        (described(extra=1), ".*only .got extra"),
        (described(noise_range=[1, 0]), "'noise_range' as"),
        (described(noise_range="a"), "'noise_range' as"),
        (described(random_rotation="yes"), "'random_rotation' as true or false .got 'yes'"),
        (described(random_rotation=None), "'random_rotation' as true or false"),
        (described(noise_range=[0, float("nan")]), "'noise_range' as"),
        *(
            (described(arguments={**SMALL, "k": k}), "'k' to be at most 16 whole")
            for k in (5, [], [1.0], [0], [True], "a")
        ),
        (described(arguments={**SMALL, "residual_k": 10**30}), "'residual_k' to be a whole number from 1 to 4096"),
        (described(arguments={**SMALL, "subtract": 1}), "'subtract' to be true or false"),
        (described(arguments={**SMALL, "channels": [4096] * len(SMALL["channels"])}), "tensor '.*' of shape"),
        (described(arguments={**SMALL, "channels": [8]}), "arguments of a DNFNet .*equal length"),
        (described(arguments={**SMALL, "channels": [1] * len(SMALL["channels"])}), "arguments of a DNFNet"),
        (described(arguments={**SMALL, "num_units": 4000}), "'num_units' of at most the number of tensors"),
        (flags(align=1e30), "'align' of type bool"),
        (flags(align="a"), "'align' of type bool"),
        (flags(surface=None), "'surface' of type bool"),
        (flags(bilateral_iterations=False), "'bilateral_iterations' of type int"),
        (flags(align=True), "'align', 'surface' and 'subtract' to be true"),
        (flags(align=True, surface=True, bilateral_iterations=-1), "'bilateral_iterations' to be a whole number"),
    ],
)
def test_refuses_descriptions_that_make_no_sense(description, message):
    with pytest.raises(WeightsError, match=rf"Expected {message}.*'here'\)\. Copy the weights again"):
        build_network(description, DNFNet(**SMALL).state_dict(), "here")


@pytest.mark.parametrize("state", [None, [], 3, {1: torch.zeros(1)}, {}, {"x": torch.zeros(1)}])
def test_refuses_states_that_are_none(state):
    with pytest.raises(WeightsError, match="here"):
        build_network(described(), state, "here")


def test_refuses_values_that_are_not_finite():
    state = copy.deepcopy(DNFNet(**SMALL).state_dict())
    state["heads.0.lins.0.weight"][0, 0] = float("nan")
    with pytest.raises(WeightsError, match=r"finite values in tensor 'heads.0.lins.0.weight' \(got NaN"):
        build_network(described(), state, "here")


@pytest.mark.parametrize(
    "change", [torch.Tensor.long, torch.Tensor.cfloat, torch.Tensor.to_sparse, lambda value: value.to("meta")]
)
def test_refuses_tensors_of_another_kind(change):
    state = DNFNet(**SMALL).state_dict()
    state["heads.0.lins.0.weight"] = change(state["heads.0.lins.0.weight"])
    with pytest.raises(WeightsError, match=r"tensor 'heads.0.lins.0.weight' of type torch.float64 \(got"):
        build_network(described(), state, "here")


@pytest.mark.parametrize(
    ("stored", "expected"), [(torch.float16, torch.float32), (torch.float32,) * 2, (torch.float64,) * 2]
)
def test_weights_keep_their_precision_from_single_precision_on(stored, expected):
    net = DNFNet(**SMALL).to(stored)
    built = build_network(described(), net.state_dict(), "here")
    assert {value.dtype for value in built.parameters()} == {expected}
    torch.testing.assert_close(built.state_dict(), net.to(expected).state_dict(), rtol=0, atol=0)


def test_missing_arguments_of_version_1_have_its_defaults():
    net = SurfaceDNFNet(k=(10, 30, 50), residual_k=20, channels=(64, 128, 256), bilateral_iterations=3)
    old = {"align": True, "surface": True, "bilateral_iterations": 3}
    assert build_network(old, net.state_dict(), "here").arguments == net.arguments


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([*SMALL, "version", "x"]), inner, max_size=4)
    ),
    max_leaves=8,
)


@given(entry=st.sampled_from(["version", "network", "arguments", "noise_range", "random_rotation", *SMALL]), value=JSON)
def test_any_change_is_refused_or_builds_the_same_layers(entry, value):
    description = described()
    target = description["arguments"] if entry in SMALL else description
    target[entry] = value
    state = DNFNet(**SMALL).state_dict()
    try:
        net = build_network(description, state, "here")
    except WeightsError:
        return
    torch.testing.assert_close(net.state_dict(), state, rtol=0, atol=0)


def test_older_descriptions_lack_what_was_added_since():
    net = SurfaceDNFNet(**SMALL)
    description = describe_network(net)
    del description["arguments"]["num_earlier"]
    check_same_network(description, net, "here")
    with pytest.raises(WeightsError, match=r"got num_earlier: 0 in the file, 2 here"):
        check_same_network(description, SurfaceDNFNet(**SMALL, num_earlier=2), "here")
