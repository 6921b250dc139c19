"""What updating has for the command line, and where its modules were."""

from rom.fields import Field

OBSERVERS = ("filter_steps", "operation", "parameter_tracking", "tracking")
PLACE = "rom.components.updating.observers"
FIELD = Field(
    verbs={"update": "rom.components.updating.verb"},
    moved={f"rom.updating.{name}": f"{PLACE}.{name}" for name in OBSERVERS}
    | {
        "rom.updating": "rom.components.updating",
        "rom.io.responses": "rom.components.updating.responses",
    },
)
