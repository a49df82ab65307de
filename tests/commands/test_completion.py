import subprocess

import pytest

from dnf_pyg.cli import main


def completed(script, *words):
    """What bash offers for the last word."""
    line = f"COMP_WORDS=(dnf-pyg {' '.join(map(repr, words))}); COMP_CWORD={len(words)}; _dnf_pyg"
    command = f'{script}\n{line}; printf "%s\\n" "${{COMPREPLY[@]}}"'
    return subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["den"], ["denoise"]),
        (["de"], ["demo", "denoise"]),
        (["denoise", "a.ply", "--stren"], ["--strength"]),
        (["denoise", "--num_p"], ["--num_passes"]),
        (["experiment", "se"], ["series"]),
        (["experiment", "series", "--me"], ["--meshes"]),
        (["weights", "ex"], ["export"]),
        (["weights", "export", "--li"], ["--licence"]),
        (["fit", "-c", "synthetic_"], ["synthetic_cpu"]),
        (["denoise", "a.p"], []),
    ],
    ids=lambda words: " ".join(words),
)
def test_words_that_fit(words, offered, capsys):
    assert main(["completion", "bash"]) == 0
    assert completed(capsys.readouterr().out, *words) == offered


def test_zsh_reads_the_same_script(capsys):
    main(["completion", "bash"])
    bash = capsys.readouterr().out
    main(["completion", "zsh"])
    assert capsys.readouterr().out == f"autoload -U +X bashcompinit && bashcompinit\n{bash}"
    assert main(["completion", "fish"]) == 2
