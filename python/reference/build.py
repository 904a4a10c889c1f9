"""Writes the reference of the installed package as pages: every public class and function, with its signature.

    pip install './python[docs,plot,rl]'
    python python/reference/build.py target/book/python-api

The texts are the docstrings, and the comments `#:` of fields. Types are those of the sources, for what is written in Rust
those of its stub `_native.pyi`. Anything that pdoc cannot read ends the build with an error.
"""

from __future__ import annotations

import __future__
import argparse
import ast
import functools
import importlib
import inspect
import pathlib
import pkgutil
import re
import shutil
import sys
import textwrap
import types
import warnings
from typing import Any

import pdoc.doc
import pdoc.render

import sidestep
from sidestep import _native, envs

#: A comment that documents the field in the line below it.
FIELD_TEXT = re.compile(r"((?:^[ \t]*#:.*\n)+)[ \t]*(?:self\.)?(\w+)[ \t]*[:=]", re.M)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="where the pages go, beside nothing else")
    pages = write_pages(parser.parse_args().folder)
    print(f"{len(pages)} pages")


def write_pages(folder: pathlib.Path) -> list[pathlib.Path]:
    """Writes the pages into a folder, in place of earlier ones, and returns their paths."""
    if folder.exists():
        if not (folder / "search.js").exists() and any(folder.iterdir()):
            sys.exit(f"{folder} has something else in it: name a new folder, or that of earlier pages")
        shutil.rmtree(folder)
    pdoc.render.configure(docformat="google", show_source=False, footer_text=f"Sidestep {sidestep.__version__}")
    written = []
    with warnings.catch_warnings():
        # What pdoc cannot read it only warns of, and leaves out.
        warnings.filterwarnings("error", module=r"pdoc\b")
        modules = documented_modules()
        for name, module in modules.items():
            path = folder / f"{name.replace('.', '/')}.html"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(pdoc.render.html_module(module, modules), encoding="utf-8")
            written.append(path)
        (folder / "index.html").write_text(pdoc.render.html_index(modules), encoding="utf-8")
        (folder / "search.js").write_text(pdoc.render.search_index(modules), encoding="utf-8")
    return [folder / "index.html", *written]


def documented_modules() -> dict[str, pdoc.doc.Module]:
    """Returns the modules with a page, by their names."""
    # pdoc does not ask a module for names that it makes when they are asked for, as it does with those of worlds.
    for name in envs.__all__:
        vars(envs).setdefault(name, getattr(envs, name))
    modules = {name: pdoc.doc.Module(importlib.import_module(name)) for name in public_modules()}
    written = Written(list(modules))
    for name, module in modules.items():
        # The package does not import those that need further packages, so that pdoc would not list them.
        module.__dict__["submodules"] = [one for other, one in modules.items() if other.rpartition(".")[0] == name]
        for member in module.members.values():
            written.document(member)
    return modules


def public_modules() -> list[str]:
    """Returns the names of the package's modules that are not private, with those of the worlds' environments."""
    found = [one.name for one in pkgutil.walk_packages(sidestep.__path__, "sidestep.")]
    public = [name for name in found if not any(part.startswith("_") for part in name.split("."))]
    return ["sidestep", *public, *(f"sidestep.envs.{name}" for name in envs.__all__ if name.endswith("_v0"))]


class Written:
    """Types as the sources have them: what Python makes of them names the insides of NumPy, a line for each array."""

    def __init__(self, modules: list[str]) -> None:
        self.stub = stub_module()
        self.public: dict[int, str] = {}
        # From the last to the first: what several modules have is named as the shortest of them names it.
        for name in sorted(modules, key=len, reverse=True):
            module = sys.modules[name]
            self.public |= {id(getattr(module, one)): f"{name}.{one}" for one in getattr(module, "__all__", ())}
        sources = [inspect.getsource(module) for name, module in sys.modules.items() if is_ours(name, module)]
        #: Names of types that modules give for themselves alone.
        self.aliases = {name: value for source in [stub_source(), *sources] for name, value in type_aliases(source)}
        #: Texts of constants, which pdoc looks for only in the module that documents them.
        self.constants = {name: text for source in sources for name, text in constant_texts(source)}

    def document(self, member: pdoc.doc.Doc[Any]) -> None:
        """Gives a member and its parts their types, and the texts that pdoc does not see."""
        if isinstance(member, pdoc.doc.Function):
            self.document_function(member, self.stub_of(member.obj, member.name))
        elif isinstance(member, pdoc.doc.Class):
            self.document_class(member)
        elif isinstance(member, pdoc.doc.Variable) and member.name in self.constants:
            member.docstring = self.constants[member.name]
            # Values are too long to read, but for those of types.
            alias = self.aliases.get(member.name)
            member.default_value = self.written_type(alias, {}) if alias else inspect.Parameter.empty

    def document_class(self, member: pdoc.doc.Class) -> None:
        stub = self.stub_of(member.obj, member.name)
        if stub is not None:
            order_members(member, list(vars(stub)))
        # Nobody calls the constructors of results, nor those of protocols.
        is_result = issubclass(member.obj, tuple) or hasattr(member.obj, "__dataclass_fields__")
        if is_result or getattr(member.obj, "_is_protocol", False):
            member.members.pop("__init__", None)
        for name, one in list(member.members.items()):
            is_constructor = stub is not None and name == "__init__"
            own = inspect.getattr_static(stub or member.obj, "__new__" if is_constructor else name, None)
            if isinstance(one, pdoc.doc.Function):
                self.document_function(one, own if stub else None)
            elif isinstance(one, pdoc.doc.Variable):
                self.document_field(member.obj, one, own)

    def document_function(self, function: pdoc.doc.Function, stub: Any) -> None:
        source = inspect.unwrap(getattr(stub, "__func__", stub) or function.obj)
        # What is inherited of others has their types. A method of several forms has a stand-in of `typing` in the stub:
        # its signature is that of Rust, without types.
        if not hasattr(source, "__annotations__") or not str(source.__module__).startswith("sidestep"):
            return
        signature = inspect.signature(source)
        parameters = [self.parameter(one, source) for one in signature.parameters.values()]
        returned = inspect.Signature.empty
        if function.name != "__init__":
            returned = self.text(signature.return_annotation, source)
        function.signature = signature.replace(parameters=parameters, return_annotation=returned)

    def parameter(self, parameter: inspect.Parameter, source: Any) -> inspect.Parameter:
        # Stubs leave a default out in this way.
        default = Text("...") if parameter.default is ... else parameter.default
        return parameter.replace(annotation=self.text(parameter.annotation, source), default=default)

    def document_field(self, owner: type, field: pdoc.doc.Variable, own: Any) -> None:
        if isinstance(own, property) and own.fget is not None:
            field.annotation = self.text(own.fget.__annotations__.get("return", field.annotation), own.fget)
        else:
            for one in owner.__mro__:
                if one.__module__.startswith("sidestep") and (written := field_types(one).get(field.name)) is not None:
                    field.annotation = self.text(written, one)
                    break
        text = field_texts(owner).get(field.name)
        if text is not None:
            field.docstring = text

    def stub_of(self, native: Any, name: str) -> Any:
        return vars(self.stub).get(name) if native is getattr(_native, name, None) else None

    def text(self, annotation: Any, owner: Any) -> Any:
        """Returns the words of an annotation in the source of a class or function."""
        if annotation is inspect.Parameter.empty:
            return annotation
        if not isinstance(annotation, str):
            annotation = getattr(annotation, "__forward_arg__", None) or inspect.formatannotation(annotation)
        names = vars(self.stub) if owner.__module__ == _native.__name__ else vars(sys.modules[owner.__module__])
        return self.written_type(annotation, names)

    def written_type(self, words: str, names: dict[str, Any]) -> Text:
        """Returns a type with the names replaced that say nothing by themselves; `names` are those of its module."""
        return Text(ast.unparse(Names(self, names).visit(ast.parse(words, mode="eval"))))


class Names(ast.NodeTransformer):
    """Replaces names in a type by what stands on the pages for them."""

    def __init__(self, written: Written, names: dict[str, Any]) -> None:
        self.written, self.names = written, names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        thing = self.names.get(node.id)
        full = self.written.public.get(id(thing))
        if full is None and getattr(thing, "__module__", None) == _native.__name__ and node.id in sidestep.__all__:
            full = f"sidestep.{node.id}"
        if full is not None:
            return ast.parse(full, mode="eval").body
        if node.id in self.written.aliases and not isinstance(thing, type):
            node = self.visit(ast.parse(self.written.aliases[node.id], mode="eval").body)
        return node


class Text:
    """A type that shows itself in given words."""

    def __init__(self, words: str) -> None:
        self.words = words

    def __repr__(self) -> str:
        return self.words


def is_ours(name: str, module: types.ModuleType) -> bool:
    is_source = str(getattr(module, "__file__", "")).endswith(".py")
    return name.partition(".")[0] == "sidestep" and is_source


def type_aliases(source: str) -> list[tuple[str, str]]:
    """Returns the names that a module has for types: `_Floats = NDArray[np.float64]`."""
    found = []
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.value, (ast.Subscript, ast.BinOp)):
            found += [(one.id, ast.unparse(statement.value)) for one in statement.targets if isinstance(one, ast.Name)]
    return found


def constant_texts(source: str) -> list[tuple[str, str]]:
    """Returns the texts of a module's constants: the comment above, or the text below."""
    found = comment_texts(source)
    body = ast.parse(source).body
    for statement, below in zip(body, body[1:], strict=False):
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) and isinstance(below.value.value, str):
            targets = getattr(statement, "targets", [getattr(statement, "target", None)])
            found += [(one.id, below.value.value) for one in targets if isinstance(one, ast.Name)]
    return found


def comment_texts(source: str) -> list[tuple[str, str]]:
    """Returns the comments `#:` by the names below them."""
    return [
        (name, " ".join(line.strip().removeprefix("#:").strip() for line in comment.splitlines()))
        for comment, name in FIELD_TEXT.findall(source)
    ]


def stub_source() -> str:
    return pathlib.Path(sidestep.__file__).with_name("_native.pyi").read_text(encoding="utf-8")


def stub_module() -> types.ModuleType:
    """Returns the stub of the native module, executed."""
    stub = types.ModuleType(_native.__name__)
    stub.__package__ = sidestep.__name__
    # Stubs name classes before they are there, which Python allows where annotations are not evaluated.
    flags = __future__.annotations.compiler_flag
    exec(compile(stub_source(), "_native.pyi", "exec", flags), vars(stub))
    return stub


def order_members(documented: pdoc.doc.Class, order: list[str]) -> None:
    """Puts the members of a native class, which have no order, into that of its stub, with its constructor first."""
    members = dict(documented.members)
    if "__new__" in order:
        name = f"{documented.qualname}.__init__"
        # The text of a native class describes its constructor.
        nothing = types.FunctionType((lambda: None).__code__, {})
        members["__init__"] = pdoc.doc.Function(documented.modulename, name, nothing, (documented.modulename, name))
        order = ["__init__", *order]
    documented.members.clear()
    documented.members.update(sorted(members.items(), key=lambda item: (order + [item[0]]).index(item[0])))


@functools.cache
def field_types(documented: type) -> dict[str, Any]:
    """Returns the types of a class's fields as they are written, also of those that its methods make: `self.x: int = 3`."""
    found = dict(inspect.get_annotations(documented))
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(documented)))
    except (OSError, TypeError):
        return found
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Attribute):
            if ast.unparse(node.target.value) == "self":
                found.setdefault(node.target.attr, ast.unparse(node.annotation))
    return found


@functools.cache
def field_texts(documented: type) -> dict[str, str]:
    """Returns the comments `#:` of a class by the names of its fields. Fields of tuples without one have an empty text."""
    # Python's own text for a field of a tuple is "Alias for field number 3".
    texts = dict.fromkeys(getattr(documented, "_fields", ()), "")
    try:
        source = inspect.getsource(documented)
    except (OSError, TypeError):
        return texts
    return texts | dict(comment_texts(source))


if __name__ == "__main__":
    main()
