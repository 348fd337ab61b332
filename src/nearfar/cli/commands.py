"""The commands of ``nearfar`` by name: each is a function in a file of its own.

Another package adds a command by an entry point of the group ``nearfar.commands``. It names a
function with a docstring and with Typer's annotations, as those listed here are.
"""

from types import FunctionType

from nearfar.registry import Registry

# In the order in which the help lists them.
COMMANDS = Registry(
    "command",
    "nearfar.commands",
    {
        "demo": "nearfar.cli.demo:demo",
        "plan": "nearfar.cli.plan:plan",
        "export": "nearfar.cli.export:export",
        "acquire": "nearfar.cli.acquire:acquire",
        "import": "nearfar.cli.import_photos:import_photos",
        "correspond": "nearfar.cli.correspond:correspond",
        "reconstruct": "nearfar.cli.reconstruct:reconstruct",
        "relight": "nearfar.cli.relight:relight",
        "superpose": "nearfar.cli.superpose:superpose",
        "compensate": "nearfar.cli.compensate:compensate",
        "bounces": "nearfar.cli.bounces:bounces",
        "probe": "nearfar.cli.probe:probe",
        "dual": "nearfar.cli.dual:dual",
        "edit": "nearfar.cli.edit:edit",
        "depth": "nearfar.cli.depth:depth",
        "evaluate": "nearfar.cli.evaluate:evaluate",
        "render": "nearfar.cli.render:render",
        "info": "nearfar.cli.info:info",
        "convert": "nearfar.cli.convert:convert",
        "check": "nearfar.cli.check:check",
        "compare": "nearfar.cli.compare:compare",
        "figures": "nearfar.cli.figures:figures",
        "separate": "nearfar.cli.separate:separate",
        "devices": "nearfar.cli.devices:devices",
        "init": "nearfar.cli.init:init",
        "preview": "nearfar.cli.preview:preview",
        "calibrate": "nearfar.cli.calibrate:calibrate",
        "view": "nearfar.cli.view:view",
    },
    FunctionType,
)
