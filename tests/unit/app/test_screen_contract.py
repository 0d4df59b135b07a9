"""The screen that the docstring of `pretravel.app` shows to who writes one."""

from __future__ import annotations

import ast
import builtins
import re
import textwrap

import pretravel.app


def test_the_example_of_a_screen_uses_what_there_is() -> None:
    """Its imports can be done, and every name in it is an import, a definition or a parameter."""
    text = str(pretravel.app.__doc__)
    example = textwrap.dedent(re.findall(r"::\n\n((?:    .*\n|\n)+)", text)[0])
    names: dict[str, object] = {}
    exec(example, names)
    assert callable(names["show"])
    known = set(names) | set(dir(builtins))
    for node in ast.walk(ast.parse(example)):
        known |= {node.arg} if isinstance(node, ast.arg) else set()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            known.add(node.id)
    used = {n.id for n in ast.walk(ast.parse(example)) if isinstance(n, ast.Name)}
    assert used <= known
