"""The OpenAPI schema of the server as the page's types: ``frontend/src/api/schema.ts``.

Beside it the texts of its closed lists, see :mod:`tools.server_texts`, and its sentences, see
:mod:`tools.server_sentences`. Writes the files, or with ``--check`` says whether they are what the
server says of itself now, or with ``--json`` prints the schema. Needs neither a network nor a
server that runs.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from odscen.maps.store import Workspace
from odscen.web.application import create_app
from tools import server_sentences, server_texts

ROOT = Path(__file__).parents[1]
TYPES = ROOT / "frontend/src/api/schema.ts"
GENERATOR = ROOT / "frontend/node_modules/.bin/openapi-typescript"
REFERENCE = "#/components/schemas/"


def schema_json() -> str:
    """The schema; the same server gives the same text."""
    schema = create_app(Workspace(Path("nowhere"))).openapi()
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def schema_types() -> str:
    """The schema as TypeScript, of what the page sends and reads."""
    with tempfile.TemporaryDirectory(prefix="odscen-api-") as folder:
        source, target = Path(folder, "openapi.json"), Path(folder, "schema.ts")
        source.write_text(json.dumps(_page_schema(json.loads(schema_json()))), encoding="utf-8")
        # Node lies beside the interpreter. What has a default may be left out of what is sent.
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        options = ["--output", str(target), "--default-non-nullable", "false"]
        done = subprocess.run(
            [str(GENERATOR), str(source), *options],
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            sys.exit(f"openapi-typescript has failed:\n{done.stdout}{done.stderr}")
        types = target.read_text(encoding="utf-8")
    # The page sends forms as they are.
    types = re.sub(r'("multipart/form-data": )(?:\{[^{}]*\}|.*);', r"\1FormData;", types)
    # The generator also writes which methods a path has not, which parameters a method has not,
    # and that answers may have headers of any name.
    types = re.sub(r"^ +\w+\?: never;\n", "", types, flags=re.MULTILINE)
    types = re.sub(
        r"^ +headers: \{\n +\[name: string\]: unknown;\n +\};\n", "", types, flags=re.MULTILINE
    )
    return re.sub(r"^ +parameters: \{\n +\};\n", "", types, flags=re.MULTILINE)


def _page_schema(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema without what the page has no use for, and with what the generator understands."""
    components = schema["components"]["schemas"]
    enumerations = {REFERENCE + name: part.get("enum") for name, part in components.items()}
    # Scenarios as files are downloaded and uploaded, but not read by the page.
    components = {name: part for name, part in components.items() if not name.endswith("-File")}
    # Unions that hold themselves are what may be anything: TypeScript takes no such property.
    for name, part in components.items():
        if "anyOf" in part and json.dumps(REFERENCE + name) in json.dumps(part):
            components[name] = {"description": part.get("description", "")}
    schema["components"]["schemas"] = components

    def translate(value: Any, *, names: bool = False) -> Any:
        """A part of the schema; ``names``: its keys are names and not words of JSON Schema."""
        if isinstance(value, list):
            return [translate(element) for element in value]
        if not isinstance(value, dict):
            return value
        if value.get("$ref", "").endswith("-File"):
            return {"type": "string", "format": "binary"}
        # Titles say again what the names say.
        value = {
            key: translate(part, names=not names and key in ("properties", "schemas"))
            for key, part in value.items()
            if names or key != "title"
        }
        # The generator knows nothing of ``propertyNames``: mappings whose keys are an enumeration
        # become objects with those keys, none of them required.
        keys = value.get("propertyNames")
        if names or keys is None or enumerations.get(keys.get("$ref")) is None:
            return value
        content = value["additionalProperties"]
        return {
            "type": "object",
            "properties": dict.fromkeys(enumerations[keys["$ref"]], content),
        }

    translated: dict[str, Any] = translate(schema)
    translated["info"] = schema["info"]
    return translated


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    does = parser.add_mutually_exclusive_group()
    does.add_argument("--check", action="store_true", help="fail if the file is not up to date")
    does.add_argument("--json", action="store_true", help="print the schema itself")
    wish = parser.parse_args()
    if wish.json:
        sys.stdout.write(schema_json())
    elif not wish.check:
        TYPES.write_text(schema_types(), encoding="utf-8")
        for target, text in _texts():
            target.write_text(text, encoding="utf-8")
    else:
        _check(TYPES, schema_types())
        for target, text in _texts():
            _check(target, text)


def _texts() -> tuple[tuple[Path, str], ...]:
    """The modules of the page with what the server says, and where they lie."""
    return (
        (server_texts.TARGET, server_texts.server_texts()),
        (server_sentences.TARGET, server_sentences.server_sentences()),
    )


def _check(file: Path, text: str) -> None:
    if not file.is_file() or file.read_text(encoding="utf-8") != text:
        sys.exit(
            f"{file.relative_to(ROOT)} is not what the server says of itself now: run make api, "
            "see what the compiler says of the page (make check), and commit both"
        )


if __name__ == "__main__":
    main()
