"""Pages that the code writes: keys of scene files, commands, objects of the core, headers. Each function gives Markdown."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PACKAGE, HEADERS = ROOT / "python" / "warmslip", ROOT / "cpp" / "warmslip"
MET = ("StepReport2", "Cost", "Stepper2", "Operators2", "Factor")  # objects of the core that a user meets


def example(text: str) -> Any:
    """An example in the percent format as a notebook."""
    import jupytext

    notebook = jupytext.reads(text, fmt="py:percent")
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return notebook


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").replace("*", "\\*").split())


# scene files


def _number(schema: dict[str, Any], name: str) -> str:
    bounds = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    return f"{name} {' and '.join(f'{sign} {schema[key]:g}' for key, sign in bounds.items() if key in schema)}".strip()


def _kind(schema: dict[str, Any]) -> str:
    """What may stand there, in words."""
    if "$ref" in schema:
        return "table"
    if options := [one for one in schema.get("anyOf", schema.get("oneOf", [])) if one.get("type") != "null"]:
        if sorted(one.get("type", "") for one in options) == ["number", "string"]:
            return "number or formula"
        return " or ".join(dict.fromkeys(map(_kind, options)))
    if "enum" in schema:
        return ", ".join(f'`"{one}"`' for one in schema["enum"])
    match schema.get("type"):
        case "array" if schema["items"].get("type") == "array":
            return "matrix"
        case "array":
            most, least = schema.get("maxItems"), schema.get("minItems")
            count = f"{least} to {most} " if most and most != least else f"{most} " if most else ""
            inner = _kind(schema["items"])
            return f"list of {count}({inner})" if " or " in inner else f"list of {count}{inner}"
        case "object":
            return f"table: name = {_kind(schema['additionalProperties'])}"
        case "integer":
            return _number(schema, "integer")
        case "number":
            return _number(schema, "number")
        case "boolean":
            return "true or false"
        case _:
            return f"text like `{schema['pattern'].strip('^$')}`" if "pattern" in schema else "text"


def _tables() -> tuple[dict[str, Any], dict[str, list[str]]]:
    """The schema, and its tables in the order of a file with the places each stands in."""
    schema = json.loads((PACKAGE / "scene.schema.json").read_text())
    places: dict[str, list[str]] = {}

    def walk(properties: dict[str, Any], where: str) -> None:
        for key, value in properties.items():
            options = [value, *value.get("anyOf", [])]
            free = any("$ref" in one["additionalProperties"] for one in options if one.get("additionalProperties"))
            for name in dict.fromkeys(re.findall(r"#/\$defs/(\w+)", json.dumps(value))):
                place = f"{where}{key}" + (".NAME" if free else "")
                places.setdefault(name, []).append(place)
                walk(schema["$defs"][name]["properties"], f"{place}.")

    walk(schema["properties"], "")
    return schema, places


def _rows(table: dict[str, Any]) -> list[str]:
    rows = ["", "| key | what | default | meaning |", "| --- | --- | --- | --- |"]
    for key, value in table["properties"].items():
        default = value.get("default")
        needed = key in table.get("required", [])
        display = "**needed**" if needed else "" if default is None else f"`{json.dumps(default)}`"
        meaning = value.get("description", "")
        if "$ref" in json.dumps(value):
            continue  # a table of its own
        rows.append(f"| `{key}` | {_cell(_kind(value))} | {display} | {_cell(meaning)} |")
    return rows


def scene() -> str:
    """Every table and key of a scene file."""
    schema, places = _tables()
    out = ["## The file itself", *_rows(schema)]
    needed = ", ".join(f"`[{key}]`" for key in schema["required"])
    out += ["", f"The tables {needed} are needed. Every other table is optional and adds one term of the model."]
    for name, where in places.items():
        table = schema["$defs"][name]
        short = [place for place in where if not place.startswith("regions.NAME.") or name.startswith("Region")]
        out += ["", f"## {', '.join(f'[{place}]' for place in short)}", "", _cell(table.get("description", ""))]
        if "contact" in where:
            out += ["", "With several contact parts, write one table `[[contact]]` for each part."]
        if len(short) < len(where):
            out += ["", "Also " + ", ".join(f"`[{place}]`" for place in where if place not in short) + "."]
        out += _rows(table)
    return "\n".join(out)


# the command line


def commands() -> str:
    """Every command with its arguments and options, from the program itself."""
    import typer

    from warmslip.cli.main import app

    group: Any = typer.main.get_command(app)
    out = ["## Options of all commands", *_parameters(group)]
    for name, command in group.commands.items():
        usage = " ".join([name, *(p.name.upper() for p in command.params if p.param_type_name == "argument")])
        out += ["", f"## {name}", "", f"`warmslip {usage}`: {_cell(command.help or '')}", *_parameters(command)]
    return "\n".join(out)


def _parameters(command: Any) -> list[str]:
    rows = ["", "| argument or option | default | meaning |", "| --- | --- | --- |"]
    for p in command.params:
        names = ", ".join(f"`{o}`" for o in (*p.opts, *p.secondary_opts)) if p.param_type_name == "option" else ""
        default = "" if p.required or p.default in (None, "", ()) or callable(p.default) else f"`{p.default}`"
        needed = "**needed**" if p.required else default
        rows.append(f"| {names or f'`{p.name.upper()}`'} | {needed} | {_cell(getattr(p, 'help', '') or '')} |")
    return rows if len(rows) > 3 else []


# the compiled core


def core() -> str:
    """What the stubs say of the objects that a user meets."""
    tree = ast.parse((PACKAGE / "_core.pyi").read_text())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    out: list[str] = []
    for name in MET:
        node = classes[name]
        other = f" (in space `{name[:-1]}3`)" if name.endswith("2") else ""
        out += ["", f"## {name.rstrip('2')}", "", f"`warmslip._core.{name}`{other}. {ast.get_docstring(node) or ''}"]
        out += ["", "| name | type | meaning |", "| --- | --- | --- |"]
        for member in node.body:
            if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                property_ = any(getattr(d, "id", "") == "property" for d in member.decorator_list)
                arguments = [a.arg for a in (*member.args.args, *member.args.kwonlyargs)][1:]
                display = member.name if property_ else f"{member.name}({', '.join(arguments)})"
                meaning = _cell(ast.get_docstring(member) or _comment(name.rstrip("2"), member.name))
                out.append(
                    f"| `{display}` | {_type(ast.unparse(member.returns) if member.returns else '')} | {meaning} |"
                )
    return "\n".join(out)


def _comment(struct: str, field: str) -> str:
    """What the headers say of a field."""
    for path in sorted(HEADERS.rglob("*.hpp")):
        if body := re.search(rf"^(?:struct|class) {struct} \{{(.*?)^\}};", path.read_text(), re.DOTALL | re.MULTILINE):
            found = re.search(rf"\b{field}\b[^;\n]*;\s*///< (.*)$", body[1], re.MULTILINE)
            return found[1] if found else ""
    return ""


def _type(text: str) -> str:
    """A type of the stubs in few words."""
    text = re.sub(r"typing\.Annotated\[numpy\.typing\.\w+(\[[\w.]+\])?, .*?\]['\"]\]", "array", text)
    text = re.sub(r"scipy\.sparse\.\w+(\[.*?\])?", "SciPy matrix", text).replace("petsc4py.PETSc.", "PETSc ")
    return f"`{text}`".replace("|", "\\|")


# the headers


def headers() -> str:
    """The modules of ARCHITECTURE.md, each header with its first comment and what Doxygen reads of it."""
    rows = re.findall(r"^\| `cpp/warmslip/(\w+)` \| (.*) \|$", (ROOT / "ARCHITECTURE.md").read_text(), re.MULTILINE)
    out: list[str] = []
    for module, what in rows:
        out += ["", f"## {module}", "", f"{what[0].upper()}{what[1:]}."]
        for path in sorted((HEADERS / module).glob("*.hpp")):
            first = re.match(r"(//.*\n)+", path.read_text())
            sentence = " ".join(re.findall(r"^// ?(.*)$", first[0], re.MULTILINE)) if first else ""
            out += ["", f"### {path.name}", "", _cell(sentence), "", "```{eval-rst}", *_shown(path), "```"]
    return "\n".join(out)


def _shown(path: Path) -> list[str]:
    """The directives of breathe for a header; breathe knows files by their names alone, so that of two it shows the types."""
    if len(list(HEADERS.rglob(path.name))) == 1:
        return [f".. doxygenfile:: {path.name}"]
    types = re.findall(r"^(?:struct|class) (\w+) \{", path.read_text(), re.MULTILINE)
    return [line for name in types for line in (f".. doxygenstruct:: warmslip::{name}", "   :members:", "")]
