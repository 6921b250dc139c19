"""What the text of a geometry may say: what is listed, whatever else gmsh understands."""

import re

import pytest

from cases.boxes import BOX_GEO
from cases.paths import ROOT
from rom.errors import UnsafeFileError
from rom.fe.mesh.sources.script import FIELDS, KNOWN_WORDS, check_script

COMMANDS = (
    "SystemCall NonBlockingSystemCall System Print Save CreateDir OnelabRun SendToServer Plugin "
    "StringToName S2N GetEnv ShapeFromFile SetNumber SetString Sleep PlotCustom Draw ReadTable "
    "OnelabAction WatchFile NoSuchCommandOfToday"
).split()
SHAPES = {  # how a word can be a command
    "with a text": '{} "pwned";',
    "with a text in single quotes": "{} 'pwned';",
    "with a variable": 'c = "pwned";\n{} c;',
    "with a function": '{} Str("pwned");',
    "with brackets": '{}("pwned");',
    "with square brackets": '{}["pwned"];',
    "with a thing": '{} View[0] "pwned";',
    "over lines and comments": '{} // so\n/* and so */ "pwned";',
    "in a branch that is not taken": 'If (0)\n{} "pwned";\nEndIf',
    "behind its own name as a variable": '{0} = 1;\n{0} "pwned";',
    "in a macro": 'Macro go\nx = 1;\n{} "pwned";\nReturn\nCall go;',
    "first in a macro": 'Macro go\n{} "pwned";\nReturn\nCall go;',
    "behind an equals sign": 'x = {} ("pwned");',
}
OPTIONS = (
    "Plugin(Smooth).Filename = 'pwned';", "Plugin(MathEval).Run;",
    "Plugin(NoSuch).OutputFile = 'x';",
    "Solver.Executable0 = 'touch';", "Solver.AutoLoadDatabase = 1;", "General.ErrorFileName = 'x';",
    "General.OptionsFileName = 'x';", "General.WatchFilePattern = '*';", "PostProcessing.Link = 1;",
    "Field[1] = ExternalProcess;", "x = 1; Field[x] = NoSuchField;",
    "Field [ 1 ] = /* so */ ExternalProcess;",
)  # fmt: skip


def refused(text, folder):
    file = folder / "attack.geo"
    file.write_text(f"{BOX_GEO}{text}\n")
    with pytest.raises(UnsafeFileError) as error:
        check_script(file)
    return str(error.value)


@pytest.mark.parametrize("shape", SHAPES)
def test_what_is_not_listed_is_no_command_in_any_shape(shape, tmp_path):
    for word in COMMANDS:
        assert word in refused(SHAPES[shape].format(word), tmp_path), word


@pytest.mark.parametrize("text", OPTIONS)
def test_options_that_name_programs_and_files_are_refused(text, tmp_path):
    word = re.search(r"(ExternalProcess|NoSuchField);|^(\w+)[(.]", text)
    assert (word[1] or word[2]) in refused(text, tmp_path)


def test_all_geometries_of_the_source_are_written_in_the_vocabulary_and_no_command_that_acts():
    assert not {*COMMANDS} & {*KNOWN_WORDS, *FIELDS}
    files = [*ROOT.glob("meshes/*.geo"), *ROOT.glob("demos/*.geo")]
    assert len(files) > 20
    for file in files:
        check_script(file)
