"""Print what lets a shell complete verbs and options at the tabulator key."""

import argparse

from rom.cli.answer import Answer
from rom.cli.options import options_of, verb_parsers

SUMMARY = "print completion for a shell"
EXAMPLES = """\
  rom completion bash   # in ~/.bashrc: source <(rom completion bash)
  rom completion zsh    # in ~/.zshrc: source <(rom completion zsh)
"""
BASH_SCRIPT = """\
_rom() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" verb="" k
    for ((k = 1; k < COMP_CWORD; k++)); do
        case "${{COMP_WORDS[k]}}" in -*) ;; *) verb="${{COMP_WORDS[k]}}"; break ;; esac
    done
    case "$verb" in
        "") COMPREPLY=($(compgen -W "{verbs}" -- "$word")) ;;
{cases}
        *) COMPREPLY=() ;;
    esac
}}
complete -o default -F _rom rom
"""
ZSH_SCRIPT = "autoload -U +X bashcompinit && bashcompinit\n"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("shell", choices=("bash", "zsh"), help="bash or zsh")


def run(args: argparse.Namespace) -> Answer:
    """Build the text from the grammar, so that it never lags behind."""
    verbs = verb_parsers(args.parser)
    cases = "\n".join(
        f'        {name}) [[ "$word" == -* ]] && COMPREPLY=($(compgen -W '
        f'"{" ".join(options_of(parser))}" -- "$word")) || COMPREPLY=() ;;'
        for name, parser in verbs.items()
    )
    text = BASH_SCRIPT.format(verbs=" ".join([*verbs, *options_of(args.parser)]), cases=cases)
    text = (ZSH_SCRIPT if args.shell == "zsh" else "") + text.rstrip("\n")
    return Answer({"shell": args.shell, "text": text}, text)
