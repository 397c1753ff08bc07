"""Errors of the parser of options in every language: its own texts are English alone."""

from typing import Any

from grader.cli.terminal import gettext
from grader.texts.authored import REMARKS
from grader.texts.failures import SEE_HELP, USAGE
from reference.errors import near_names


def told_of(error: Any, root: Any) -> str:  # noqa: ANN401 - click's error and context, which typer does not name
    """Return the sentence of an error, by its class; empty for what is no error, such as the help.

    Arguments: `root` is the program's own context, whose `obj` are the words of the call.
    """
    kind, context, param = type(error).__name__, error.ctx or root, getattr(error, "param", None)
    name, near = getattr(error, "option_name", ""), getattr(error, "possibilities", None)
    if kind == "UsageError" and context is root:
        kind, name = "NoSuchCommand", root.obj[0]
        near = near_names(name, root.command.list_commands(root))
    elif kind == "BadOptionUsage" and any(word.startswith(f"{name}=") for word in root.obj):
        kind = "flag"
    elif param is not None:
        name = param.opts[0] if param.param_type_name == "option" else param.metavar or param.name
    value: dict[str, Any] = error.__cause__.errors()[0] if hasattr(error.__cause__, "errors") else {}
    kind = value["type"] if value.get("type") in USAGE else kind
    if kind not in USAGE:
        return ""
    hint = f" ({gettext(REMARKS['near'][0], near=', '.join(near))})" if near else ""
    text = gettext(USAGE[kind], name=name, **value.get("ctx", {})) + hint
    return gettext(SEE_HELP, text=text, command=context.command_path)
