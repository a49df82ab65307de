"""Draw the curves of the runs that `training_runs.py` made: `training_curves.py RUNS` writes docs/images/training_*."""

import csv
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

IMAGES = Path(__file__).parents[1] / "images"
LONG_RUNS = Path(__file__).parents[2] / "training" / "long_runs.csv"
BLUE, ORANGE, GREEN, GREY = "#2563c9", "#d9731a", "#2f8f4e", "0.55"
mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True})
mpl.rcParams.update({"grid.alpha": 0.3, "legend.frameon": False})


def curve(folder, key):
    """Steps and values of one column."""
    with (folder / "metrics.csv").open() as file:
        rows = [(int(row["step"]), float(row[key])) for row in csv.DictReader(file) if row.get(key)]
    return [step for step, _ in rows], [value for _, value in rows]


def smooth(values, reach=12):
    """Mean over the steps around each."""
    windows = [values[max(0, i - reach) : i + reach + 1] for i in range(len(values))]
    return [sum(window) / len(window) for window in windows]


def losses(axes, folder, key, color, label):
    steps, values = curve(folder, key)
    axes.plot(steps, values, color=color, alpha=0.25, linewidth=0.8)
    axes.plot(steps, smooth(values), color=color, label=label)
    axes.set_yscale("log")
    axes.set_xlabel("step")


def panels(count=2):
    figure = Figure(figsize=(4.0 * count, 3), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(1, count, squeeze=False)[0]


def save(figure, name):
    figure.savefig(IMAGES / f"training_{name}.png")
    print(IMAGES / f"training_{name}.png")


def real(runs):
    figure, (left, right) = panels()
    losses(left, runs / "real", "train/loss", BLUE, "training loss")
    for key, color, label in (
        ("train/theta", GREY, "training patches"),
        ("val/theta", BLUE, "held-back patches"),
        ("val/mesh_theta", ORANGE, "held-back mesh, vertices updated"),
    ):
        right.plot(*curve(runs / "real", key), "o-", markersize=3, color=color, label=label)
    right.set_ylim(bottom=0)
    right.set(xlabel="step", ylabel="θ (degrees)")
    left.legend()
    right.legend()
    save(figure, "curves")


def joint(runs):
    figure, (left, right) = panels()
    for name, color, label in (("gaussian", BLUE, "Gaussian, K = 12"), ("kinect", ORANGE, "Kinect v1 views, K = 30")):
        losses(left, runs / "joint", f"train/{name}/loss", color, label)
        right.plot(*curve(runs / "joint", f"train/{name}/theta"), "o-", markersize=3, color=color, label="training")
        right.plot(*curve(runs / "joint", f"val/{name}/theta"), "s--", markersize=3, color=color, label="held back")
    left.set_ylabel("loss")
    left.legend()
    right.set_ylim(bottom=0)
    right.set(xlabel="step", ylabel="θ of patches (degrees)")
    right.legend(ncols=2)
    save(figure, "joint")


def resume(runs):
    whole, killed, resumed = (dict(zip(*curve(runs / name, "train/loss"), strict=True))
                              for name in ("unbroken", "killed", "resumed"))  # fmt: skip
    figure, (left, right) = panels()
    left.plot(whole.keys(), whole.values(), color=GREY, linewidth=4, alpha=0.6, label="unbroken")
    left.plot(killed.keys(), killed.values(), color=BLUE, label="until kill -9")
    left.plot(resumed.keys(), resumed.values(), "--", color=ORANGE, label="resumed from last.ckpt")
    left.axvline(max(killed), color="black", linewidth=0.8)
    left.set(xlabel="step", ylabel="training loss", yscale="log")
    left.legend(frameon=True)
    gap = {step: abs(value - whole[step]) for part in (killed, resumed) for step, value in part.items()}
    right.plot(gap.keys(), gap.values(), ".", color=ORANGE)
    right.set_ylim(-1e-7, max(1e-6, 1.1 * max(gap.values())))
    right.set(xlabel="step", ylabel="difference from the unbroken run")
    save(figure, "resume")
    print(f"largest difference of the loss {max(gap.values()):.2e} over {len(gap)} steps")


def processes(runs):
    figure, (left, right) = panels()
    for axes, key, title in ((left, "train/theta", "training patches"), (right, "val/theta", "held-back patches")):
        one, two, apart = (curve(runs / name, key) for name in ("processes_1", "processes_2", "accumulated"))
        axes.plot(*one, color=GREY, linewidth=4, alpha=0.6, label="1 process, batches of 8")
        axes.plot(*two, "--", color=ORANGE, label="2 processes, batches of 4 each")
        axes.plot(*apart, ":", color=BLUE, label="1 process, gradients of two batches of 4")
        axes.set_ylim(bottom=0)
        axes.set(xlabel="step", ylabel="θ (degrees)", title=title)
        axes.legend()
        late = [sum(values[-12:]) / 12 for _, values in (one, two, apart)]
        print(f"{title}: mean θ of the last 12 epochs {', '.join(f'{value:.2f}' for value in late)}")
    save(figure, "processes")


def optimizers(runs):
    """The short runs that differ in the optimizer alone, and the long runs of the packaged weights."""
    figure, (left, middle, right) = panels(3)
    for name, color, label in (
        ("adamw_2e-3", GREY, "AdamW, rate 0.002"),
        ("adamw_4e-3", BLUE, "AdamW, rate 0.004"),
        ("muon_4e-3", ORANGE, "Muon, rate 0.004"),
    ):
        steps, values = curve(runs / name, "val/theta")
        left.plot([4 * (step + 1) for step in steps], values, "o-", markersize=3, color=color, label=label)
        print(f"{label}: {values[-1]:.2f}")
    left.set(title="held back, the same short run", xlabel="training patches", ylabel="θ (degrees)")
    with LONG_RUNS.open() as file:
        rows = list(csv.DictReader(file))
    for axes, measure in ((middle, "held-back patches"), (right, "test meshes")):
        points = defaultdict(list)
        for row in rows:
            if row["measure"] == measure:
                points[f"{row['run']}, {row['optimizer']}"].append(
                    (int(row["patches"]) / 1000, float(row["theta_deg"]))
                )
        for label, places in points.items():
            axes.plot(*zip(*places, strict=True), "o-", markersize=3, label=label)
        axes.set(title=f"{measure}, long runs", xlabel="training patches (thousands)")
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
    left.set_ylim(5, 11)
    for axes in (left, middle, right):
        axes.legend(fontsize=7)
    save(figure, "optimizers")


def copy_last(runs):
    """The last error map of the mesh that the first run denoised on the way."""
    pictures = sorted((runs / "real" / "mesh_errors").glob("*.png"), key=lambda path: path.stat().st_mtime)
    picture = Image.open(pictures[-1]).convert("RGB")
    picture = picture.resize((800, 800 * picture.height // picture.width), Image.Resampling.LANCZOS)
    picture.quantize(96).save(IMAGES / "training_mesh.png", optimize=True)


def main():
    runs = Path(sys.argv[1])
    copy_last(runs)
    for draw in (real, joint, resume, processes, optimizers):
        draw(runs)


if __name__ == "__main__":
    main()
