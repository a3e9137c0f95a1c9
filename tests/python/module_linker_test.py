"""The linker that makes one ES module of many: what it links runs as the modules would, and the rest is refused."""

import shutil
import subprocess

import pytest

from heliograph.module_linker import LinkError, link


def linked(files, entry="main.js"):
    def read(name):
        if name not in files:
            raise FileNotFoundError(2, "No such file or directory")
        return files[name]

    return link(read, entry)


def printed(text, folder):
    """What the module prints, run by node."""
    if not shutil.which("node"):
        pytest.skip("node is not installed")
    file = folder / "linked.mjs"
    file.write_text(text)
    done = subprocess.run(["node", file], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_forms_run(tmp_path):
    files = {
        "main.js": """import { twice as double, Shape } from './lib/numbers.js';
import * as all from './lib/numbers.js';
import {
  NAME,
  sum,
} from './lib/more.js';
import './effect.js';
const a = 1; // as in numbers.js: each module has its own names
console.log(double(a + 20), new Shape().sides, Object.keys(all).sort().join(), NAME, sum(1, 2), all.count());
all.count();
console.log(typeof this, all.ticks);
import('./late.js').then(({ late }) => console.log(late));
export default { a };
""",
        "lib/numbers.js": """const a = 'another';
let made = 0;
export var ticks = 0;
export function twice(x) {
  return 2 * x;
}
export class Shape {
  sides = 4;
}
export async function later() {
  return a;
}
export const count = () => (ticks = ++made);
""",
        "lib/more.js": """import { twice } from './numbers.js';
const NAME = 'x', rest = 1;
function plus(a, b) {
  return twice(a + b) + rest;
}
export { NAME, plus as sum };
""",
        "effect.js": "globalThis.effects = (globalThis.effects ?? 0) + 1;\n",
        "late.js": """import './effect.js';
const text = `${globalThis.effects} effect`;
console.log('late runs');
export { text as late };
""",
    }
    text = linked(files)
    assert printed(text, tmp_path).splitlines() == [
        "42 4 Shape,count,later,ticks,twice x 7 1",
        "undefined 2",
        "late runs",
        "1 effect",
    ]
    assert text.count("export default ") == 1 and "\nimport " not in text


def test_what_is_exported_of_the_entry(tmp_path):
    text = linked({"main.js": "export const a = 1;\nexport default { a };\n"})
    (tmp_path / "user.mjs").write_text("import entry, { a } from './linked.mjs';\nconsole.log(entry.a + a);\n")
    (tmp_path / "linked.mjs").write_text(text)
    if shutil.which("node"):
        done = subprocess.run(["node", tmp_path / "user.mjs"], capture_output=True, text=True, timeout=60)
        assert done.stdout == "2\n", done.stderr
    assert text.endswith(".a;\nexport default $module0.default;\n")


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("import x from './a.js';", "main.js:1: a form of import or export that is not understood: import x from"),
        ("\nimport { a } from 'a';", "main.js:2: the path of a module begins with ./ or ../"),
        ("import { a } from './a';", "main.js:1: the path of a module begins with"),
        ("import { a } from '../a.js';", "stays inside the folder"),
        ("import { b } from './a.js';", "main.js:1: a.js exports no b"),
        ("import { changing } from './a.js';", "changing of a.js may change"),
        ("import { a } from './none.js';", "none.js: No such file or directory, imported by main.js"),
        ("import { a } from './main.js';", "main.js -> main.js: modules that import each other in a circle"),
        ("import { a.b } from './a.js';", "a list of names that is not understood"),
        ("export * from './a.js';", "main.js:1: a form of import or export that is not understood"),
        ("export { a } from './a.js';", "main.js:1: a form of import or export that is not understood"),
        ("export const { a } = b;", "main.js:1: a form of import or export that is not understood"),
        ("export const a = 1;\nexport { b as a };", "main.js:2: a is exported twice"),
        (
            "const a = import.meta.url;",
            "main.js:1: a form of import or export that is not understood: const a = import",
        ),
        ("import(where);", "main.js:1: a form of import or export that is not understood"),
        ("f();\nconst a = await import(where);", "main.js:2: a form of import or export that is not understood"),
        ("  import { a } from './a.js';", "main.js:1: a form of import or export that is not understood"),
        ("f(); export const b = 1;", "main.js:1: a form of import or export that is not understood"),
        ("/*\nexport const b = 1;\n*/", "main.js:2: a line of a comment or template that looks like a statement"),
        ("const t = `\nimport { a } from './a.js';\n`;", "main.js:2: a line of a comment or template"),
        ("const $module0 = 1;", "names with $module are the linker's own"),
    ],
)
def test_what_is_not_understood_is_refused(source, told):
    with pytest.raises(LinkError) as caught:
        linked({"main.js": source + "\n", "a.js": "export const a = 1;\nexport let changing = 2;\n"})
    assert told in str(caught.value)
