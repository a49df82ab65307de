import pytest
import torch
from lightning.pytorch import Trainer
from torch_geometric.data import Batch, Data

from dnf_pyg.errors import WeightsError
from dnf_pyg.evaluate.metrics import angular_difference
from dnf_pyg.nn import DNFNet
from dnf_pyg.train.losses import JointLoss
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.weights.load import load_network

SMALL = {"k": (2, 3, 4), "residual_k": 3, "channels": (8, 8, 8), "embedding_channels": 8}


def patch(seed, num_faces=30, k=4):
    generator = torch.Generator().manual_seed(seed)
    near = torch.stack([torch.arange(num_faces), *torch.randint(num_faces, (k - 1, num_faces), generator=generator)])
    edge_index = torch.stack([near.t().flatten(), torch.arange(num_faces).repeat_interleave(k)])
    clean = torch.nn.functional.normalize(torch.randn(1, 3, generator=generator), dim=-1).expand(num_faces, 3)
    normal = torch.nn.functional.normalize(clean + 0.3 * torch.randn(num_faces, 3, generator=generator), dim=-1)
    return Data(x=normal, y=clean, edge_index=edge_index, num_nodes=num_faces)


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
            stages = module.net.stages(batch.x, batch.edge_index, batch.batch)
            angles.append(angular_difference(stages[-1][0], batch.y))
            losses.append(JointLoss()(stages, batch.y, batch.batch).total)
    assert values["val/theta"] == pytest.approx(float(torch.cat(angles).mean()), rel=1e-5)
    assert values["val/loss"] == pytest.approx(float(torch.stack(losses).mean()), rel=1e-5)


def test_a_single_patch_trains(module, tmp_path):
    loader = torch.utils.data.DataLoader([Batch.from_data_list([patch(0)])], batch_size=None)
    trainer(tmp_path, max_steps=1, enable_checkpointing=False).fit(module, loader)
    assert all(value.isfinite().all() for value in module.net.state_dict().values())


def test_train_k_only_counts_while_training(module, batches):
    module.train_k = (1, 2, 2)
    module.eval()
    assert module._edges(batches[0]) is batches[0].edge_index
    module.train()
    assert [edges.size(1) for edges in module._edges(batches[0])] == [60, 120, 120]


def test_all_neighbours_count_after_train_k_steps(batches, tmp_path):
    module = NormalFilteringModule(DNFNet(**SMALL), train_k=(1, 2, 2), train_k_steps=2)
    seen = []
    stages = module.net.stages
    module.net.stages = lambda normal, edges, *more: seen.append(torch.is_tensor(edges)) or stages(normal, edges, *more)
    loader = torch.utils.data.DataLoader(batches, batch_size=None)
    trainer(tmp_path, max_steps=3, enable_checkpointing=False).fit(module, loader)
    assert seen == [False, False, True]


def test_starts_from_trained_weights_and_leaves_new_layers_as_they_are(tmp_path):
    torch.manual_seed(0)
    DNFNet(**SMALL).save_pretrained(tmp_path / "first")
    more = DNFNet(**SMALL, bilateral_iterations=2)
    fresh = more.bilateral.guidance.weight.clone()
    module = NormalFilteringModule(more, initial_weights=str(tmp_path / "first"))
    for name, value in load_network(tmp_path / "first").state_dict().items():
        assert torch.equal(module.net.state_dict()[name], value), name
    assert torch.equal(module.net.bilateral.guidance.weight, fresh)
    other = DNFNet(**{**SMALL, "embedding_channels": 16})
    with pytest.raises(WeightsError, match=r"Expected weights of the configured network .* change `model.net`"):
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
