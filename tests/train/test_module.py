import pytest
import torch
from lightning.pytorch import Trainer
from torch_geometric.data import Batch, Data

from dnf_pyg.errors import WeightsError
from dnf_pyg.mesh.geometry import angular_difference
from dnf_pyg.nn import DNFNet
from dnf_pyg.train.losses import JointLoss
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.muon import MuonAdamW
from dnf_pyg.train.settings import PartSettings, Thinning
from dnf_pyg.weights.load import load_network

SMALL = {"k": (2, 3, 4), "residual_k": 3, "channels": (8, 8, 8), "embedding_channels": 8}


def patch(seed, num_faces=30, k=4):
    generator = torch.Generator().manual_seed(seed)
    near = torch.stack([torch.arange(num_faces), *torch.randint(num_faces, (k - 1, num_faces), generator=generator)])
    edge_index = torch.stack([near.t().flatten(), torch.arange(num_faces).repeat_interleave(k)])
    clean = torch.nn.functional.normalize(torch.randn(1, 3, generator=generator), dim=-1).expand(num_faces, 3)
    normal = torch.nn.functional.normalize(clean + 0.3 * torch.randn(num_faces, 3, generator=generator), dim=-1)
    rank = torch.arange(k).repeat(num_faces)
    return Data(x=normal, y=clean, edge_index=edge_index, edge_attr=rank)


@pytest.fixture
def module():
    torch.manual_seed(0)
    return NormalFilteringModule(DNFNet(**SMALL))


@pytest.fixture
def batches():
    return [Batch.from_data_list([patch(2 * i), patch(2 * i + 1)]) for i in range(3)]


def trainer(folder, **options):
    quiet = {"logger": False, "enable_progress_bar": False, "enable_model_summary": False}
    return Trainer(accelerator="cpu", default_root_dir=folder, **quiet, **options)


def test_training_lowers_theta(module, tmp_path):
    loader = torch.utils.data.DataLoader([patch(i) for i in range(8)], batch_size=4, collate_fn=Batch.from_data_list)
    fitting = trainer(tmp_path, max_epochs=40, enable_checkpointing=False, log_every_n_steps=1)
    before = trainer(tmp_path).validate(module, loader, verbose=False)[0]["val/theta"]
    fitting.fit(module, loader)
    after = trainer(tmp_path).validate(module, loader, verbose=False)[0]["val/theta"]
    assert after < 0.5 * before


def test_validation_values_match_the_formulas(module, batches, tmp_path):
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    values = trainer(tmp_path).validate(module, loader, verbose=False)[0]
    module.eval()
    angles, losses = [], []
    with torch.no_grad():
        for batch in batches:
            stages = module.net.stages(**module.net.gather(batch))
            angles.append(angular_difference(stages[-1][0], batch.y))
            losses.append(JointLoss()(stages, batch.y, batch.batch).total)
    assert values["val/theta"] == pytest.approx(float(torch.cat(angles).mean()), rel=1e-5)
    assert values["val/loss"] == pytest.approx(float(torch.stack(losses).mean()), rel=1e-5)


def test_a_single_patch_trains(module, tmp_path):
    loader = torch.utils.data.DataLoader([Batch.from_data_list([patch(0)])], batch_size=None)
    trainer(tmp_path, max_steps=1, enable_checkpointing=False).fit(module, loader)
    assert all(value.isfinite().all() for value in module.net.state_dict().values())


def edges_of_steps(module, batches, folder):
    """Number of edges of each level in every training step; ``None`` where the network selects them."""
    seen, gather = [], module.net.gather
    module.net.gather = lambda batch, edges=None: (
        seen.append(edges and [level.size(1) for level in edges]) or gather(batch, edges)
    )
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    trainer(folder, max_steps=3, enable_checkpointing=False).fit(module, loader)
    return seen


@pytest.mark.parametrize(("num_steps", "expected"), [(None, 3), (2, 2), (0, 0)])
def test_thinning_ends_after_its_steps(batches, tmp_path, num_steps, expected):
    module = NormalFilteringModule(DNFNet(**SMALL), thinning=Thinning([1, 2, 2], num_steps))
    assert edges_of_steps(module, batches, tmp_path) == [[60, 120, 120]] * expected + [None] * (3 - expected)


def test_thinning_only_counts_while_training(batches, tmp_path):
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    plain = NormalFilteringModule(DNFNet(**SMALL))
    thinned = NormalFilteringModule(plain.net, thinning=Thinning([1, 2, 2]))
    values = [trainer(tmp_path).validate(one, loader, verbose=False)[0] for one in (plain, thinned)]
    assert values[0] == values[1]


def test_settings_of_another_number_of_levels():
    with pytest.raises(ValueError, match=r"'k' of 'thinning' with 3 levels \(got \[1, 2\]\)"):
        NormalFilteringModule(DNFNet(**SMALL), thinning=Thinning([1, 2]))
    with pytest.raises(ValueError, match=r"'k' of 'far' with 3 levels \(got \[4\]\)"):
        NormalFilteringModule(DNFNet(**SMALL), parts={"far": PartSettings([4])})


def test_starts_from_trained_weights_and_leaves_new_layers_as_they_are(tmp_path):
    torch.manual_seed(0)
    DNFNet(**SMALL).save_pretrained(tmp_path / "first")
    more = DNFNet(**SMALL, num_units=3)
    fresh = more.heads[2].lins[0].weight.clone()
    module = NormalFilteringModule(more, initial_weights=str(tmp_path / "first"))
    for name, value in load_network(tmp_path / "first").state_dict().items():
        assert torch.equal(module.net.state_dict()[name], value), name
    assert torch.equal(module.net.heads[2].lins[0].weight, fresh)
    other = DNFNet(**{**SMALL, "embedding_channels": 16})
    with pytest.raises(WeightsError, match=r"Expected weights of the configured network .* Change `model.net`"):
        NormalFilteringModule(other, initial_weights=str(tmp_path / "first"))


def test_checkpoint_rebuilds_the_network_and_refuses_another(module, batches, tmp_path):
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    fitting = trainer(tmp_path, max_steps=2)
    fitting.fit(module, loader)
    path = tmp_path / "net.ckpt"
    fitting.save_checkpoint(path)
    net = load_network(path)
    for key, value in module.net.state_dict().items():
        torch.testing.assert_close(net.state_dict()[key], value)
    other = NormalFilteringModule(DNFNet(**{**SMALL, "k": (1, 3, 4)}))
    with pytest.raises(WeightsError, match=r"k: \[2, 3, 4\] in the file, \[1, 3, 4\] here"):
        trainer(tmp_path).validate(other, loader, ckpt_path=path, weights_only=True, verbose=False)


@pytest.fixture
def saved(batches, tmp_path):
    """A module trained for two steps, and its checkpoint."""
    torch.manual_seed(0)
    module = NormalFilteringModule(DNFNet(**SMALL), optimizer=MuonAdamW)
    fitting = trainer(tmp_path, max_steps=2)
    fitting.fit(module, torch.utils.data.DataLoader(batches, batch_size=None))
    fitting.save_checkpoint(tmp_path / "net.ckpt")
    return module, tmp_path / "net.ckpt"


def test_a_checkpoint_alone_rebuilds_the_module(saved, batches):
    module, path = saved
    again = NormalFilteringModule.load_from_checkpoint(path)
    assert again.training
    assert again.net.training
    torch.testing.assert_close(dict(again.state_dict()), dict(module.state_dict()), rtol=0, atol=0)
    torch.testing.assert_close(again.eval()(batches[0]), module.eval()(batches[0]), rtol=0, atol=0)
    assert NormalFilteringModule.load_from_checkpoint(path, scheduler_interval="step").scheduler_interval == "step"


def test_no_class_that_a_checkpoint_names_is_called(saved, tmp_path):
    _, path = saved
    content = torch.load(path, weights_only=True)
    content["hyper_parameters"] = {
        "_instantiator": "lightning.pytorch.cli.instantiate_module",
        "optimizer": {"class_path": "pathlib.Path.touch", "init_args": {"self": str(tmp_path / "touched")}},
    }
    torch.save(content, path)
    NormalFilteringModule.load_from_checkpoint(path)
    assert not (tmp_path / "touched").exists()


@pytest.mark.parametrize("change", [{"state_dict": None}, {"statistics": 3}, {"network": []}, {"state_dict": {}}])
def test_a_damaged_checkpoint_of_a_module(saved, change):
    _, path = saved
    torch.save({**torch.load(path, weights_only=True), **change}, path)
    with pytest.raises(WeightsError, match=r"net\.ckpt"):
        NormalFilteringModule.load_from_checkpoint(path)


def test_goes_on_from_a_checkpoint_of_version_1(saved, batches, tmp_path):
    module, path = saved
    content = torch.load(path, weights_only=True)
    flags = {"align": False, "surface": False, "bilateral_iterations": 0}
    content["network"] = {**content["network"]["arguments"], **flags}
    torch.save(content, path)
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    again = NormalFilteringModule(DNFNet(**SMALL), optimizer=MuonAdamW)
    fitting = trainer(tmp_path, max_steps=4, enable_checkpointing=False)
    fitting.fit(again, loader, ckpt_path=path, weights_only=True)
    assert fitting.global_step == 4
    torch.testing.assert_close(load_network(path).state_dict(), module.net.state_dict(), rtol=0, atol=0)


def test_trains_in_double_precision(batches, tmp_path):
    torch.manual_seed(0)
    module = NormalFilteringModule(DNFNet(**SMALL))
    fitting = trainer(tmp_path, max_steps=1, precision="64-true", enable_checkpointing=False)
    fitting.fit(module, torch.utils.data.DataLoader(batches, batch_size=None))
    reference = NormalFilteringModule(module.net).train()
    stages = reference.net.stages(**reference.net.gather(batches[0]))
    assert all(value.dtype == torch.float64 for stage in stages for value in stage)
    assert JointLoss()(stages, batches[0].y, batches[0].batch).total.dtype == torch.float64
    assert fitting.callback_metrics["train/loss"].dtype == torch.float64


def test_predicts_a_batch_of_each_data_set(batches):
    settings = {"near": PartSettings([1, 2, 3])}
    module = NormalFilteringModule(DNFNet(**SMALL), parts=settings, separate_statistics=["near", "far"]).eval()
    with module.statistics.use("near"):
        for norm in (layer for layer in module.net.modules() if isinstance(layer, torch.nn.BatchNorm1d)):
            norm.running_mean += 0.5
    found = module.predict_step({"near": batches[0], "far": batches[1]}, 0)
    for name, batch in (("near", batches[0]), ("far", batches[1])):
        alone = module.network_for(name)
        torch.testing.assert_close(found[name], alone(**alone.gather(batch)))
    assert module.network_for("near").k == (1, 2, 3)
    assert module.network_for("far").k == (2, 3, 4)
    with pytest.raises(ValueError, match=r"'data_set' to be one of \['far', 'near'\] \(got 'fat'\)\. Change it"):
        module.network_for("fat")
