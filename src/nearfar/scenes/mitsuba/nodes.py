"""The nodes of a Mitsuba scene file, between its reading and the making of its objects.

A state is Mitsuba's ``parser.ParserState``: a flat list of nodes, each with its properties, among
which references to other nodes.
"""

from pathlib import Path
from typing import Any

from nearfar.errors import InputError


def kind_of(node: Any) -> str:
    """Return a node's kind: Scene, Sensor, Emitter, ..."""
    return str(node.type).rpartition(".")[2]


def nodes(state: Any, kind: str, plugin: str | None = None) -> list[Any]:
    """List the properties of all nodes of a kind, or of one plug-in."""
    return [
        node.props
        for node in state.nodes
        if kind_of(node) == kind and plugin in {None, node.props.plugin_name()}
    ]


def one(state: Any, kind: str, plugin: str | None = None) -> Any:
    """Return the properties of the only node of its kind."""
    return nodes(state, kind, plugin)[0]


def require_one_of_each(state: Any, path: Path) -> None:
    """Refuse a file that is not a scene with one projector and one sensor.

    Raises
    ------
    InputError
    """
    if kind_of(state.root) != "Scene":
        raise InputError(f"{path} is a Mitsuba file but no scene: name the file of a whole scene.")
    for found, what, cure in (
        (nodes(state, "Emitter", "projector"), "projector", 'an <emitter type="projector">'),
        (nodes(state, "Sensor"), "sensor", "a <sensor>"),
    ):
        if not found:
            raise InputError(f"{path} has no {what}: add {cure} to the scene.")
        if len(found) > 1:
            raise InputError(f"{path} has {len(found)} {what}s: leave one of them in the scene.")


def children(state: Any, props: Any) -> dict[str, Any]:
    """Return the nodes below a node, by the name of the property that holds each."""
    import mitsuba as mi

    return {
        name: state.nodes[value.index()]
        for name, value in props.items()
        if isinstance(value, mi.Properties.ResolvedReference)
    }


def child(state: Any, props: Any, kind: str) -> dict[str, Any]:
    """Return plug-in (as ``type``) and properties of a node's child of a kind; empty if none."""
    found = [node for node in children(state, props).values() if kind_of(node) == kind]
    return {"type": found[0].props.plugin_name(), **dict(found[0].props.items())} if found else {}


def replace(props: Any, name: str, value: Any) -> None:
    """Set a property, whatever type it had."""
    if name in props:
        del props[name]
    props[name] = value


def replace_child(state: Any, props: Any, kind: str, value: Any) -> None:
    """Put an object in place of a node's children of a kind."""
    for name, node in children(state, props).items():
        if kind_of(node) == kind:
            del props[name]
    props[f"nearfar_{kind.lower()}"] = value
