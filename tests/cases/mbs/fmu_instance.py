"""An FMU as another program holds it, through fmpy."""

import importlib

import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
for part in ("fmi1", "fmi2", "validation"):
    importlib.import_module(f"fmpy.{part}")


class Instance:
    """One instance, its variables by their names."""

    def __init__(self, path, tmp_path, guid=None, log=None):
        self.description = fmpy.read_model_description(str(path))
        self.refs = {v.name: v.valueReference for v in self.description.modelVariables}
        self.folder = fmpy.extract(str(path), str(tmp_path / "a folder"))
        self.log = [] if log is None else log
        self.fmu = fmpy.fmi2.FMU2Slave(
            guid=guid or self.description.guid, unzipDirectory=self.folder, instanceName="one",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        self.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
            lambda environment, name, status, category, text: self.log.append(text.decode())
        )
        callbacks.logger = self.logger
        self.fmu.instantiate(callbacks=callbacks)

    def begin(self, **start):
        for name, value in start.items():
            self.set(name, value)
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def set(self, name, value):
        self.fmu.setReal([self.refs[name]], [value])

    def get(self, *names):
        return np.array(self.fmu.getReal([self.refs[name] for name in names]))

    def fails(self, call, *arguments):
        """The message of a call that answers with fmi2Error."""
        with pytest.raises(fmpy.fmi1.FMICallException, match=r"status 3 \(error\)"):
            call(*arguments)
        return self.log[-1]
