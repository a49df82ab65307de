"""A script that completes the words of ``dnf-pyg`` when Tab is pressed."""

from collections.abc import Iterator

from dnf_pyg.commands import COMMANDS, LIGHTNING
from dnf_pyg.commands.configs import packaged_configs
from dnf_pyg.commands.options import CompletionOptions
from dnf_pyg.commands.parser import option_parser
from dnf_pyg.commands.terminal import tell

__all__ = ["run"]

_SCRIPT = """\
_dnf_pyg() {{
    local words=""
    if [[ $COMP_CWORD -eq 1 ]]; then
        words="{commands}"
    else
        case "${{COMP_WORDS[1]}} ${{COMP_WORDS[2]}}" in
{cases}
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F _dnf_pyg dnf-pyg
"""  # -o default: names of files where no word fits


def run(options: CompletionOptions) -> None:
    """Print the script."""
    names = sorted({name.split()[0] for name in (*COMMANDS, *LIGHTNING)})
    if options.shell == "zsh":
        tell("autoload -U +X bashcompinit && bashcompinit")
    tell(*_SCRIPT.format(commands=" ".join(names), cases="\n".join(_cases())).splitlines())


def _cases() -> Iterator[str]:
    """Words after each command; a case of two words goes before that of the first alone."""
    groups = {name.split()[0] for name in COMMANDS if " " in name}
    for name in sorted({*COMMANDS, *groups, *LIGHTNING}, key=lambda name: (" " not in name, name)):
        words = [other.split()[1] for other in COMMANDS if other.startswith(f"{name} ")]
        if name in COMMANDS:
            actions = option_parser(COMMANDS[name].options, name)._actions
            words += [flag for action in actions for flag in action.option_strings]
        if name in LIGHTNING:
            words += ["-c", "--config", "--help", *([] if name == "predict" else ["--ckpt_path", *packaged_configs()])]
        yield f'            "{name if " " in name else name + " "}"*) words="{" ".join(words)}" ;;'
