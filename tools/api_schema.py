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
    """The schema as TypeScript."""
    with tempfile.TemporaryDirectory(prefix="odscen-api-") as folder:
        source, target = Path(folder, "openapi.json"), Path(folder, "schema.ts")
        schema = json.loads(schema_json())
        names = {f"{REFERENCE}{key}": one for key, one in _components(schema).items()}
        schema["components"]["schemas"] |= _unknown(schema)
        source.write_text(json.dumps(_spelled_out(schema, names)), encoding="utf-8")
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
        return target.read_text(encoding="utf-8")


def _components(schema: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = schema["components"]["schemas"]
    return found


def _unknown(schema: dict[str, Any]) -> dict[str, Any]:
    """Unions that hold themselves, as what may be anything: TypeScript takes no such property."""
    return {
        name: {"description": one.get("description", "")}
        for name, one in _components(schema).items()
        if "anyOf" in one and json.dumps(REFERENCE + name) in json.dumps(one)
    }


def _spelled_out(value: Any, components: dict[str, Any]) -> Any:
    """Mappings whose keys are an enumeration as objects with those keys, none of them required.

    The generator knows nothing of ``propertyNames``.
    """
    if isinstance(value, list):
        return [_spelled_out(one, components) for one in value]
    if not isinstance(value, dict):
        return value
    value = {key: _spelled_out(one, components) for key, one in value.items()}
    names = value.get("propertyNames")
    keys = components.get(names["$ref"], {}).get("enum") if names and "$ref" in names else None
    if keys is None:
        return value
    return {"type": "object", "properties": dict.fromkeys(keys, value["additionalProperties"])}


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
