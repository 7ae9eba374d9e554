"""`kernel`: numba's njit with a disk cache that notices edits in other files.

numba's own cache compares a function with its own source file only. A kernel that calls a law in another file would
keep running the old law after that file changed. Here the key of a compiled kernel covers every source of mechanics
that its module imports, directly or not, so an edit leads to a fresh compilation, never to stale physics.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import sigutils
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher as CPUDispatcher

from graben.mechanics.kernel_cache import KernelCache

_MECHANICS = Path(__file__).parent
_PACKAGE = "graben.mechanics"
# Statements that import from graben, wherever in a file: parsing whole files would slow every start.
_FROM = rb"from[ \t]+graben[\w.]*[ \t]+import[ \t]*(?:\([^)]*\)|(?:[^\n(\\]|\\\n)+)"
_IMPORTS = re.compile(rb"^[ \t]*(" + _FROM + rb"|import[ \t][^\n]*\bgraben\b[^\n]*)", re.MULTILINE)


def kernel(function: Callable[..., Any] | None = None, *, pairing: bool = False, **options: Any) -> Any:
    """Compile `function` in nopython mode with the cache described above; options are those of numba.njit.

    pairing : like operations on neighbouring numbers, x and y say, become one on both (SLP vectorization). Compilers
    of C do so by default, numba does not. Results stay the same, bit for bit. It reaches all that is called there.
    """
    if function is None:
        return lambda f: kernel(f, pairing=pairing, **options)
    dispatcher: Any = numba.njit(no_cfunc_wrapper=True, **options)(function)
    dispatcher._cache = _cache_of(function, options | {"pairing": True} if pairing else options)
    if isinstance(dispatcher, CPUDispatcher):  # not so under NUMBA_DISABLE_JIT
        _spare_wrappers(dispatcher, function, options)
        if pairing:
            compiler: Any = getattr(dispatcher, "_compiler")  # noqa: B009
            compiler.compile = _with_pairing(compiler.compile)
    return dispatcher


def _with_pairing(compile_: Callable[..., Any]) -> Callable[..., Any]:
    """numba's compilation (under its lock) with its setting for pairing, which is one for all kernels, turned on."""

    def paired(*arguments: Any) -> Any:
        before = numba.config.SLP_VECTORIZE
        numba.config.SLP_VECTORIZE = 1
        try:
            return compile_(*arguments)
        finally:
            numba.config.SLP_VECTORIZE = before

    return paired


def _spare_wrappers(dispatcher: Any, function: Callable[..., Any], options: dict[str, Any]) -> None:
    """Other kernels call a twin without what Python would need to call it: a fifth of the time of compilation."""
    own_template, own_overload = dispatcher.get_call_template, dispatcher.get_overload

    @cache
    def twin() -> Any:
        bare = {"no_cpython_wrapper": True, **options}
        made = numba.njit(no_cfunc_wrapper=True, **bare)(function)
        made._cache = _cache_of(function, bare)
        return made

    def known(arguments: Iterable[Any]) -> bool:
        return tuple(arguments) in dispatcher.overloads

    def get_call_template(args: Any, kws: Any) -> Any:
        folded = dispatcher._compiler.fold_argument_types(args, kws)[1]
        return own_template(args, kws) if known(folded) else twin().get_call_template(args, kws)

    def get_overload(signature: Any) -> Any:
        arguments = sigutils.normalize_signature(signature)[0]
        return own_overload(signature) if known(arguments) else twin().get_overload(signature)

    dispatcher.get_call_template, dispatcher.get_overload = get_call_template, get_overload


def c_kernel(signature: str, function: Callable[..., Any], **options: Any) -> Any:
    """Compile `function` for that signature as one that can be called by its `address`, with the same disk cache."""
    compiled: Any = CFunc(function, sigutils.normalize_signature(signature), locals={}, options=options)
    compiled._cache = _cache_of(function, options, signature)
    compiled.compile()
    return compiled


def _cache_of(function: Callable[..., Any], options: dict[str, Any], signature: str = "") -> KernelCache:
    key = f"{digest_of_sources(function.__module__)} {sorted(options.items())} {signature}".rstrip()
    return KernelCache(function, key)


@cache
def digest_of_sources(module: str) -> str:
    """SHA-256 of the source of a module of mechanics and of all that it imports from mechanics, directly or not."""
    found, waiting = {module}, [module]
    while waiting:
        more = _imported(waiting.pop()) - found
        found |= more
        waiting += more
    return hashlib.sha256("".join(f"{name} {_digest(name)}\n" for name in sorted(found)).encode()).hexdigest()


@cache
def _sources() -> dict[str, Path]:
    """Every module of mechanics and its file."""
    found = {}
    for path in _MECHANICS.rglob("*.py"):
        parts = path.relative_to(_MECHANICS).with_suffix("").parts
        found[".".join((_PACKAGE, *(parts[:-1] if parts[-1] == "__init__" else parts)))] = path
    return found


@cache
def _read(module: str) -> bytes:
    return _sources()[module].read_bytes()


@cache
def _digest(module: str) -> str:
    return hashlib.sha256(_read(module)).hexdigest()


@cache
def _imported(module: str) -> frozenset[str]:
    """The modules of mechanics that one of them imports, wherever in its file."""
    return frozenset(name for text in _IMPORTS.findall(_read(module)) for name in _names(text) if name in _sources())


def _names(statement: bytes) -> Iterator[str]:
    """Dotted names that may be modules: `from a import b` may mean a.b."""
    try:
        tree = ast.parse(statement)
    except SyntaxError:
        return  # a line of a docstring
    for node in tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
